"""Run the blocks of pages, each in a folder and a process of its own, and say what came of each block.

`python driver.py JOBS.json`, which has "jobs", one a page, and how many go on "at_once". A job has the folders `desk` and
`pictures`, the file `results`, files to `keep`, and `steps`: {"do": "python" | "sh" | "save" | "merge" | "read", ...}. The
runner starts it.
"""

import ast
import json
import linecache
import os
import shutil
import subprocess
import sys
import tempfile
import tomllib
import types
from contextlib import contextmanager, suppress
from pathlib import Path

SMALL = {
    "estimator": {"kind": "kalman", "motion": {"kind": "random_walk", "sigma": 1.0}},
    "sensors": {"sensor": {"kind": "cartesian_position", "sigma": 1.0}},
    "associator": {"kind": "nearest"},
    "birth": {"kind": "from_returns"},
    "lifecycle": {"kind": "m_of_n"},
}
SHELL = """set -aeo pipefail
[ -f {state} ] && . {state}
{code}
{{ export -p; echo cd '"'"$PWD"'"'; }} > {state}
"""


@contextmanager
def captured(text):
    """Append to `text` what is written to standard output within, by this process and those that it starts."""
    sys.stdout.flush()
    kept = os.dup(1)
    with tempfile.TemporaryFile() as file:
        os.dup2(file.fileno(), 1)
        try:
            yield
        finally:
            sys.stdout.flush()
            os.dup2(kept, 1)
            os.close(kept)
            file.seek(0)
            text.append(file.read().decode(errors="replace"))


def shown(value):
    """Tell whether a notebook's reader wants to see this value: not what matplotlib's functions return."""
    first = value[0] if isinstance(value, list | tuple) and value else value
    return value is not None and not type(first).__module__.startswith("matplotlib")


def python(step, names, where):
    """Execute a block as a cell of a notebook: the value of a last expression is printed."""
    code = "\n" * (step["line"] - 1) + step["code"]
    linecache.cache[where] = (len(code), None, code.splitlines(keepends=True), where)
    tree = ast.parse(code, where)
    last = tree.body.pop() if tree.body and isinstance(tree.body[-1], ast.Expr) else None
    exec(compile(tree, where, "exec"), names)
    if last is not None:
        value = eval(compile(ast.Expression(last.value), where, "eval"), names)
        if shown(value) and not step["code"].rstrip().endswith(";"):
            print(repr(value))


def sh(step, state):
    """Execute a block in a shell that keeps its folder and variables from one block to the next."""
    code = SHELL.format(state=state, code=step["code"])
    code = subprocess.run(["bash", "-c", code], stdin=subprocess.DEVNULL, stderr=subprocess.STDOUT, check=False).returncode
    if code:
        raise SystemExit(f"exit code {code}")


def merged(base, part):
    """Return the config with a part put in; a component of another kind takes the place of the old one."""
    if not isinstance(base, dict) or not isinstance(part, dict) or part.get("kind", base.get("kind")) != base.get("kind"):
        return part
    return base | {key: merged(base.get(key), value) for key, value in part.items()}


def merge(step):
    """Build the tracker of a config with the part that a block shows."""
    import vedette

    base = tomllib.loads(Path(step["into"]).read_text(encoding="utf-8"))
    vedette.load(merged(base, tomllib.loads(step["code"])))


def read(step):
    """Read a block of JSON, whole or line by line."""
    try:
        json.loads(step["code"])
    except json.JSONDecodeError:
        for line in step["code"].splitlines():
            json.loads(line)


def unnamed(step):
    """Refuse a block of data of which the page does not say what to do with it."""
    raise ValueError("a block is saved under the name in a line `name`: above it, or tried: <!-- into: tracker.toml -->")


def install(step):
    """Refuse a block that would change the environment in which the blocks of all pages run."""
    raise ValueError("installs packages: such a block needs the mark `*Not run here: reason.*`")


def save(step):
    """Save a block as the file that its title names."""
    Path(step["title"]).parent.mkdir(parents=True, exist_ok=True)
    Path(step["title"]).write_text(step["code"], encoding="utf-8")


def drawn(folder, number):
    """Save the figures that are open, if there is a folder for them, and close them; return their files and titles."""
    if "matplotlib.pyplot" not in sys.modules:
        return []
    import matplotlib as mpl
    import matplotlib.pyplot as plt

    found = []
    if folder is None:
        plt.close("all")
        return found
    with mpl.rc_context({"svg.hashsalt": "vedette"}):
        for i, one in enumerate(plt.get_fignums()):
            figure = plt.figure(one)
            titles = [axes.get_title() or axes.get_title("left") for axes in figure.axes]
            title = " / ".join(filter(None, [figure.get_suptitle(), *titles]))
            name = f"{number}{chr(ord('a') + i)}.svg"
            figure.savefig(folder / name, metadata={"Date": None}, bbox_inches="tight")
            if (folder / name).stat().st_size > 400_000:  # many thousand points
                (folder / name).unlink()
                name = name.replace(".svg", ".png")
                figure.savefig(folder / name, dpi=150, bbox_inches="tight")
            found.append({"file": name, "title": title})
    plt.close("all")
    return found


def page(job):
    """Go through the steps of a page and stop at the first that fails, unless the page says how it fails."""
    os.chdir(job["desk"])
    results, pictures, told = Path(job["results"]), job["pictures"] and Path(job["pictures"]), []
    module = types.ModuleType("__main__")
    sys.modules["__main__"] = module
    sys.path.insert(0, job["desk"])
    state = results.with_suffix(".shell").as_posix()
    for number, step in enumerate(job["steps"]):
        printed, error, began = [], None, cpu()
        where = f"{step['page']}, block of line {step['line']}"
        with captured(printed):
            try:
                if step["do"] == "python":
                    python(step, module.__dict__, where)
                elif step["do"] == "sh":
                    sh(step, state)
                else:
                    {"save": save, "merge": merge, "read": read, "unnamed": unnamed, "install": install}[step["do"]](step)
            except (Exception, SystemExit) as problem:
                error = str(problem) if isinstance(problem, SystemExit) else f"{type(problem).__name__}: {problem}"
        output = "".join(printed) + (f"{error}\n" if error and step["do"] == "python" else "")
        about = {"line": step["line"], "printed": output, "error": error, "took": cpu() - began}
        told.append(about | {"pictures": drawn(pictures, number)})
        results.write_text(json.dumps(told), encoding="utf-8")
        if error and step["printed"] is None:
            break
    for name in job["keep"]:
        if pictures and Path(name).exists():
            shutil.copy(name, pictures / name.replace("/", "-"))


def cpu():
    """Return the CPU time of this process and of those that it started, s."""
    return sum(os.times()[:4])


def main():
    """Run one page here, or several from one process that has imported Vedette and its plugins."""
    told = json.loads(Path(sys.argv[1]).read_text(encoding="utf-8"))
    jobs = told["jobs"]
    if len(jobs) == 1:
        page(jobs[0])
        return
    import vedette

    with suppress(ImportError):
        import matplotlib.pyplot as plt  # noqa: F401

        import vedette.testing.kit
    vedette.load(SMALL)  # imports the plugins, and what reads configs
    going = set()
    for job in jobs:
        if len(going) == told["at_once"]:
            going.remove(os.wait()[0])
        if (child := os.fork()) == 0:
            page(job)
            sys.stdout.flush()
            os._exit(0)
        going.add(child)
    while going:
        going.remove(os.wait()[0])


if __name__ == "__main__":
    main()
