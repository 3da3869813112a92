"""Sessions for developers: `nox` for the quick checks; docs/releasing.md names those that come before a release."""

import os
import sysconfig
import tomllib
from pathlib import Path

import nox

nox.options.sessions = ["lint", "tests"]
PYTHONS = ["3.11", "3.12", "3.13"]
HERE = Path(__file__).parent


EVERY_PROCESSOR = "-Ccmake.define.VEDETTE_INSTRUCTION_SETS=all"


def built(session: nox.Session, folder: Path, *options: str) -> str:
    """Build the distribution in `folder` afresh and return its wheel."""
    out = Path(session.create_tmp()) / folder.name
    session.run("python", "-m", "pip", "wheel", "-q", "--no-deps", *options, "--wheel-dir", str(out), str(folder))
    return str(max(out.glob("*.whl"), key=lambda wheel: wheel.stat().st_mtime))


def indexed(session: nox.Session, *wheels: str) -> str:
    """Lay out wheels as a package index (PEP 503) and return its address."""
    index = Path(session.create_tmp()).resolve() / "index"
    for wheel in (Path(wheel).resolve() for wheel in wheels):
        project = wheel.name.partition("-")[0].replace("_", "-")
        page = index / project / "index.html"
        page.parent.mkdir(parents=True, exist_ok=True)
        page.write_text(f'<!doctype html><a href="{wheel.as_uri()}">{wheel.name}</a>', encoding="utf-8")
    return index.as_uri()


def compiled(session: nox.Session) -> tuple[str, ...]:
    """Return options with which a wheel holds what an editable installation has compiled, and is not compiled again."""
    pattern = f"core/vedette/**/*{sysconfig.get_config_var('EXT_SUFFIX')}"
    if not any(HERE.glob(pattern)):
        session.error(f"nothing is compiled: no {pattern}; install the checkout with `pip install -e .`")
    return "-Cwheel.cmake=false", "-Cwheel.platlib=true", f"-Csdist.include={pattern}"


@nox.session
def lint(session: nox.Session) -> None:
    """Check style, types and the layers between packages."""
    session.install("-e", ".[dev]")
    session.run("ruff", "check", ".")
    session.run("ruff", "format", "--check", ".")
    session.run("mypy")
    session.run("lint-imports")


@nox.session(python=PYTHONS)
def tests(session: nox.Session) -> None:
    """Run all tests in an editable installation."""
    session.install("-e", ".[dev]")
    session.run("python", "-m", "pytest", "-n", "auto", *session.posargs)


def lowest_versions() -> list[str]:
    """Return the lowest versions that pyproject.toml declares: of what the build, the library, its extras and tests need."""
    document = tomllib.loads((HERE / "pyproject.toml").read_text(encoding="utf-8"))
    project, builders = document["project"], document["build-system"]["requires"]
    extras = dict(project["optional-dependencies"])
    extras.pop("site")  # pinned, and for no user
    extras.pop("rerun")  # half a gigabyte, for few tests
    tools = [tool for tool in extras.pop("dev") if tool.startswith(("jsonschema", "markdown", "pytest-xdist"))]
    declared = [*builders, *project["dependencies"], *(one for extra in extras.values() for one in extra), *tools]
    return sorted({one.partition(",")[0].replace(">=", "==") for one in declared})


@nox.session(python=PYTHONS[0])
def lowest(session: nox.Session) -> None:
    """Run all tests, or those named, with exactly the lowest versions declared: `nox -s lowest -- tests/config`."""
    older = "pyparsing<3.3"  # 3.3 deprecates what matplotlib 3.9 calls
    session.install("--only-binary", ":all:", *lowest_versions(), older, "cmake", "ninja")
    session.install("--no-deps", "--no-build-isolation", "-e", ".")  # kernels draw random numbers for one numpy only
    session.run("python", "-m", "pip", "check")
    session.run("python", "-m", "pytest", "-n", "auto", "--all", *session.posargs)


@nox.session(python=PYTHONS)
def wheel(session: nox.Session) -> None:
    """Build the wheel for every processor, install it from an index, and run the main job away from the checkout."""
    index = indexed(session, built(session, HERE, EVERY_PROCESSOR))
    session.install("--force-reinstall", "--no-deps", "--index-url", index, "vedette")
    session.install("vedette[report]")  # what it needs, from the usual index
    session.chdir(session.create_tmp())
    session.run("vedette", "run", str(HERE / "examples" / "harbour.toml"), "--out", "harbour")


@nox.session
def instruction_sets(session: nox.Session) -> None:
    """Test the kernels compiled for each instruction set that this processor has; other builds have the best alone."""
    session.install(EVERY_PROCESSOR, "-e", ".[dev]")
    session.run("python", "-m", "pytest", "-n", "auto", "tests/kernels", *session.posargs)


@nox.session
def nightly(session: nox.Session) -> None:
    """Run the tests with the strong statistical profile, every block of the documentation and every notebook: slow."""
    session.install("-e", ".[dev,site]")
    session.run("python", "-m", "pytest", "-n", "auto", "--vedette-profile", "nightly", *session.posargs)


@nox.session
def plugin_template(session: nox.Session) -> None:
    """Test the example of a third-party plugin against Vedette, both as wheels; `-- compiled`: with the kernels here."""
    example = HERE / "examples" / "plugin_template"
    options = compiled(session) if "compiled" in session.posargs else ()
    index = indexed(session, built(session, HERE, *options), built(session, example))
    session.install("--force-reinstall", "--no-deps", "--index-url", index, "vedette", "vedette-road")
    session.install("vedette[testing]", "vedette-road")  # what they need, from the usual index
    session.chdir(session.create_tmp())
    session.run("python", "-m", "pytest", "-p", "no:cacheprovider", "--rootdir", str(example), str(example / "tests"))
    session.run("vedette", "check", "clothoid")
    session.run("vedette", "run", str(example / "road.toml"), "--out", "road")


@nox.session
def benchmarks(session: nox.Session) -> None:
    """Compare speed with peers, installed in their own environment: `nox -s benchmarks -- --quick`. See docs/speed.md."""
    session.install(".")
    peers = Path(session.create_tmp()) / "peers"
    session.run("python", "-m", "venv", str(peers))
    python = str(peers / ("Scripts/python.exe" if os.name == "nt" else "bin/python"))
    session.run(python, "-m", "pip", "install", "-q", "-r", "benchmarks/peers.txt", external=True)
    session.run("python", "-m", "benchmarks", "--peers-python", python, *session.posargs)


@nox.session
def site(session: nox.Session) -> None:
    """Run the documentation's code blocks and build its site into .site/html, with warnings and dead links as errors."""
    session.install("-e", ".[adapters,data,marine,report,site,study,testing,vision,yaml]", "playwright", "axe-core-python")
    with session.chdir("docs"):
        session.run("python", "-m", "docsite", "build", *session.posargs)
    session.run("python", "-m", "pytest", "-q", "tests/docs/test_site_in_browser.py")  # skipped without Chromium


@nox.session
def fuzz(session: nox.Session) -> None:
    """Feed configs, inputs and kernels with wrong ones, for minutes; `nox -s fuzz -- --seed 7 --hours 8` for longer."""
    session.install("-e", ".[dev]")
    session.chdir("tests")
    session.run("python", "-m", "fuzz", *session.posargs, env={"OPENBLAS_NUM_THREADS": "1"})


@nox.session
def guided(session: nox.Session) -> None:
    """Feed readers with bytes that coverage leads to new code, by Atheris: `nox -s guided -- --seconds 600`."""
    session.install("-e", ".[dev]", "atheris>=3")
    session.chdir("tests")
    session.run("python", "-m", "fuzz.guided", *session.posargs, env={"OPENBLAS_NUM_THREADS": "1"})


@nox.session
def endurance(session: nox.Session) -> None:
    """Memory along a day of 50 vessels, and 10^6 scans of one track: `nox -s endurance -- --scans 5000 --long 50000`."""
    session.install(".")
    session.run("python", "-m", "benchmarks.endurance", *session.posargs)


@nox.session
def memory(session: nox.Session) -> None:
    """Run the compiled kernels' tests under the address and undefined-behaviour sanitizers of GCC."""
    flags = "-fsanitize=address,undefined -fno-sanitize-recover=undefined -g -O1"
    build = {"CXXFLAGS": flags, "LDFLAGS": "-fsanitize=address,undefined", "SKBUILD_CMAKE_BUILD_TYPE": "Debug"}
    session.install(".[testing]", env=build)
    runtime = session.run("g++", "-print-file-name=libasan.so", silent=True, external=True)
    names = ("kernels", "standard/estimators/test_imm.py", "test_values.py", "tools/smoothing/test_compiled.py")
    tests = [str(HERE / "tests" / name) for name in names]
    session.chdir(session.create_tmp())  # away from the checkout, so that the installed kernels are tested
    sanitized = {"LD_PRELOAD": str(runtime).strip(), "ASAN_OPTIONS": "detect_leaks=0:quarantine_size_mb=1"}
    options = ["-q", "-s", "-p", "no:cacheprovider", "-c", os.devnull, "--rootdir", str(HERE), "--import-mode=importlib"]
    options += ["-o", f"pythonpath={HERE / 'tests'}"]
    session.run("python", "-m", "pytest", *options, *tests, env=sanitized)


@nox.session(venv_backend="none")
def arm64(session: nox.Session) -> None:
    """Compare the kernels' results on emulated ARM64 with this processor's. Needs g++-aarch64-linux-gnu and qemu-user."""
    flags = ["-O3", "-std=c++17", "-fno-math-errno", "-fno-trapping-math", "-w", "-DVEDETTE_ISA=baseline"]
    folder = Path(session.create_tmp())
    found = {}
    for compiler, run in (("g++", []), ("aarch64-linux-gnu-g++", ["qemu-aarch64"])):
        program = str(folder / compiler)
        session.run(compiler, *flags, "-static", "core/cpp/check.cpp", "-o", program)
        found[compiler] = [line.split() for line in str(session.run(*run, program, silent=True)).splitlines()]
    here, there = found.values()
    if [name for name, _ in here] != [name for name, _ in there] or not here:
        session.error("the two print other kernels")
    worst = max(abs(float(a) - float(b)) / max(1.0, abs(float(a))) for (_, a), (_, b) in zip(here, there, strict=True))
    session.log(f"{len(here)} numbers, the largest difference {worst:.1e}")
    if not worst < 1e-12:
        session.error("they differ")
