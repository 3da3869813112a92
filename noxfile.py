"""What a developer runs: `nox` for the quick checks, `nox -s wheel`, `nox -s nightly` before a release."""

import nox

nox.options.sessions = ["lint", "tests"]
nox.options.default_venv_backend = "venv"
PYTHONS = ["3.11", "3.12", "3.13"]


@nox.session
def lint(session: nox.Session) -> None:
    """Style, types and the layers between packages."""
    session.install("-e", ".[dev]")
    session.run("ruff", "check", ".")
    session.run("ruff", "format", "--check", ".")
    session.run("mypy")
    session.run("lint-imports")


@nox.session(python=PYTHONS)
def tests(session: nox.Session) -> None:
    """All tests, in an editable installation."""
    session.install("-e", ".[dev]")
    session.run("python", "-m", "pytest", "-n", "auto", *session.posargs)


@nox.session(python=PYTHONS)
def wheel(session: nox.Session) -> None:
    """Build the wheel, install it with nothing else, and run the main job away from the checkout."""
    out = session.create_tmp()
    session.install("build")
    session.run("python", "-m", "build", "--wheel", "--outdir", out)
    session.install("--force-reinstall", "--find-links", out, "--pre", "vedette[report]")
    example = session.invoked_from + "/examples/harbour.toml"
    session.chdir(out)
    session.run("vedette", "run", example, "--out", "harbour")


@nox.session
def nightly(session: nox.Session) -> None:
    """The tests with the strong statistical profile: slow."""
    session.install("-e", ".[dev]")
    session.run("python", "-m", "pytest", "-n", "auto", "--vedette-profile", "nightly", *session.posargs)


@nox.session(python=PYTHONS)
def plugin_template(session: nox.Session) -> None:
    """Build the example of a third-party plugin and Vedette into wheels, and test the one against the other."""
    out, example = session.create_tmp(), session.invoked_from + "/examples/plugin_template"
    session.install("build", "hatchling", "scikit-build-core")
    for folder in (session.invoked_from, example):
        session.run("python", "-m", "build", "--wheel", "--outdir", out, folder)
    session.install("--force-reinstall", "--find-links", out, "vedette[testing]", "vedette-clothoid")
    session.run("python", "-m", "pytest", "-p", "no:cacheprovider", "--rootdir", example, example + "/tests")
    session.run("vedette", "check", "clothoid")
    session.run("vedette", "run", example + "/road.toml", "--out", out + "/road")
