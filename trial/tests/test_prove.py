"""``python -m trial prove``: processes that see one case each, resuming, errors that stay lines,
what run.json says.
"""

import hashlib
import json
import os
import shutil
import signal
import subprocess
import sys
import time
from pathlib import Path

import pytest

import pamrs
from tests.diagnosis import again
from tests.diagnosis.held import RIG, hold
from trial.__main__ import main
from trial.prove import cases_of, code_digest, prove, valid_result

ROOT = Path(__file__).parents[2]
#: A diagnosis that writes down what it was given and answers by the name of the case.
WORKER = """
import json, os, sys
case, option, out = sys.argv[1:]
assert option == "--json"
name = os.path.basename(case)
assert os.listdir() in (["stdout", "stderr"], ["stderr", "stdout"]), os.listdir()
if name == "broken":
    sys.exit("pamrs: error: the valve is upside down")
if name == "killed":
    os.kill(os.getpid(), 9)
verdict = "effects" if name.startswith("leak") else "none"
seen = {"case": case, "out": out, "threads": os.environ["OPENBLAS_NUM_THREADS"], "pid": \
os.getpid()}
with open(out, "w") as file:
    json.dump({"schema": "pamrs.diagnosis/1", "verdict": verdict, "seconds": 1.5, "seen": seen}, \
file)
while sum(os.times()[:2]) < 0.05:
    pass
"""


@pytest.fixture
def fake(tmp_path):
    script = tmp_path / "worker.py"
    script.write_text(WORKER)
    return [sys.executable, str(script)]


def make(home, *names, manifest=True):
    for name in names:
        (home / "cases" / name).mkdir(parents=True)
        (home / "cases" / name / "case.toml").write_text("")
    (home / "keys").mkdir()
    if manifest:
        (home / "manifest.json").write_text(json.dumps({"keys": dict.fromkeys(names, "0" * 64)}))
    return home


def sealed(folder, conductance):
    """A hold of a known chamber, 60 s at 10 Hz, as a case on disk."""
    one = hold(conductance, 60.0)
    one.units["muscle_pressure"] = "Pa"
    again.written(pamrs.Case("hold", RIG, [one], folder), folder)


def test_every_case_has_a_process_that_is_given_that_case_alone(tmp_path, fake):
    home = make(tmp_path / "trial", "leak_a", "tight_b", "tight_c")
    lines = []
    proof = prove(home, jobs=2, say=lines.append, command=fake)
    assert proof.verdicts == {"none": 2, "parameters": 0, "effects": 1, "unlisted": 0}
    assert not proof.failed
    seen = [valid_result(home / "results" / name / "out.json")["seen"] for name in proof.cases]
    assert len({s["pid"] for s in seen}) == 3
    for name, told in zip(proof.cases, seen, strict=True):
        out = home / "results" / name / "out.json"
        assert (told["case"], told["out"]) == (str(home / "cases" / name), str(out))
        assert told["threads"] == "1"
    assert len(lines) == 3
    assert "left" in lines[0]
    assert "left" not in lines[2]


def test_run_json_says_with_what_and_how_long(tmp_path, fake):
    home = make(tmp_path / "trial", "leak_a")
    prove(home, command=fake)
    told = json.loads((home / "results" / "run.json").read_text())
    assert told["schema"] == "pamrs.prove/1"
    assert told["version"] == pamrs.__version__
    digest = hashlib.sha256((home / "manifest.json").read_bytes()).hexdigest()
    assert told["manifest_sha256"] == digest
    assert told["machine"]["cores"] >= 1
    entry = told["cases"]["leak_a"]
    wanted = {"verdict": "effects", "seconds": 1.5, "code": code_digest()}
    assert entry.items() >= wanted.items()
    assert entry["cpu_seconds"] > 0.03


def test_a_run_goes_on_where_it_was(tmp_path, fake):
    home = make(tmp_path / "trial", "leak_a", "leak_b", "leak_c")
    prove(home, command=fake, limit=1)
    first = (home / "results" / "leak_a" / "out.json").read_bytes()
    (home / "results" / "leak_b").mkdir()
    half = '{"schema": "pamrs.diagnosis/1", "verd'
    (home / "results" / "leak_b" / "out.json").write_text(half)
    proof = prove(home, command=fake)
    assert proof.kept == 1
    assert len(proof.cases) == 3
    assert "cpu_seconds" in proof.cases["leak_a"]
    assert (home / "results" / "leak_a" / "out.json").read_bytes() == first
    assert prove(home, command=["/bin/false"]).kept == 3
    assert prove(home, command=fake, fresh=True).kept == 0
    assert (home / "results" / "leak_a" / "out.json").read_bytes() != first


def test_a_result_of_another_case_of_that_name_is_not_kept(tmp_path, fake):
    home = make(tmp_path / "trial", "leak_a", "leak_b")
    prove(home, command=fake)
    (home / "cases" / "leak_b" / "case.toml").write_text("# another\n")
    assert prove(home, command=fake).kept == 1
    assert prove(home, command=fake).kept == 2


def test_results_of_other_code_are_pointed_out(tmp_path, fake):
    home = make(tmp_path / "trial", "leak_a")
    prove(home, command=fake)
    file = home / "results" / "run.json"
    file.write_text(file.read_text().replace(code_digest(), "0" * 64))
    lines = []
    prove(home, command=fake, say=lines.append)
    assert "1 of them made by other code" in lines[0]


def test_a_case_that_fails_is_a_line_and_is_tried_again(tmp_path, fake):
    home = make(tmp_path / "trial", "broken", "killed", "leak_a")
    proof = prove(home, command=fake, jobs=2)
    assert proof.failed == {
        "broken": "the valve is upside down",
        "killed": "the process was killed by signal 9",
    }
    assert proof.verdicts["error"] == 2
    assert "error" in proof.table()
    assert prove(home, command=fake).kept == 1


def test_interrupted_workers_are_ended(tmp_path):
    home = make(tmp_path / "trial", "a", "b")
    script = tmp_path / "worker.py"
    script.write_text(
        "import os, sys, time\nfile = os.path.dirname(os.path.dirname(sys.argv[3])) + '/pid'\n"
        "if sys.argv[1].endswith('b'):\n    open(file, 'w').write(str(os.getpid()))\n"
        "    time.sleep(60)\n"
        "while not os.path.exists(file) or not open(file).read():\n    time.sleep(0.02)\n"
    )

    def stop(text):
        raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        prove(home, jobs=2, say=stop, command=[sys.executable, str(script)])
    with pytest.raises(ProcessLookupError):
        os.kill(int((home / "results" / "pid").read_text()), 0)


@pytest.mark.skipif(os.name == "nt", reason="signals are those of POSIX")
@pytest.mark.parametrize(
    ("number", "wait"),
    [(signal.SIGTERM, 0.0), (signal.SIGTERM, 0.3), (signal.SIGHUP, 0.1), (signal.SIGINT, 0.1)],
)
def test_a_signal_leaves_no_worker_and_no_folder(tmp_path, number, wait):
    home = make(tmp_path / "home", "a", "b", "c")
    slow = (
        "import os, sys, time; open(sys.argv[3] + '.pid', 'w').write(str(os.getpid())); "
        "time.sleep(60)"
    )
    program = f"""
import sys
from trial.prove import prove
prove({str(home)!r}, jobs=2, command=[sys.executable, "-c", {slow!r}])
"""
    temporary = tmp_path / "tmp"
    temporary.mkdir()
    paths = os.pathsep.join([str(ROOT), os.environ.get("PYTHONPATH", "")])
    with subprocess.Popen(
        [sys.executable, "-c", program],
        env={**os.environ, "TMPDIR": str(temporary), "PYTHONPATH": paths},
        stderr=subprocess.DEVNULL,
        # whoever runs the tests may ignore it, and a child would go on ignoring it
        preexec_fn=lambda: signal.signal(number, signal.SIG_DFL),
    ) as process:
        began = time.monotonic()
        while not list(home.glob("results/*/out.json.pid")) and time.monotonic() - began < 60.0:
            time.sleep(0.02)
        time.sleep(wait)
        process.send_signal(number)
        ended = process.wait(30)
    assert ended == (-signal.SIGINT if number == signal.SIGINT else 128 + number)
    workers = [int(f.read_text()) for f in home.glob("results/*/out.json.pid") if f.read_text()]
    assert workers
    for pid in workers:
        with pytest.raises(ProcessLookupError):
            os.kill(pid, 0)
    assert list(temporary.iterdir()) == []


def test_a_case_that_takes_too_long_is_given_up(tmp_path):
    home = make(tmp_path / "trial", "a")
    proof = prove(home, timeout=0.2, command=[sys.executable, "-c", "import time; time.sleep(60)"])
    assert proof.failed == {"a": "given up after 0 s"}


@pytest.mark.parametrize(
    ("listed", "words"), [(["a"], "does not list b"), (["a", "b", "c"], "not there: c")]
)
def test_the_manifest_lists_the_cases(tmp_path, listed, words):
    home = make(tmp_path / "trial", "a", "b")
    (home / "manifest.json").write_text(json.dumps({"keys": dict.fromkeys(listed, "")}))
    with pytest.raises(ValueError, match=words):
        prove(home)
    assert not (home / "results").exists()


def test_what_is_refused(tmp_path):
    with pytest.raises(ValueError, match="no such folder"):
        cases_of(tmp_path / "nowhere")
    with pytest.raises(ValueError, match="no case below it"):
        cases_of(tmp_path)
    home = make(tmp_path / "trial", "a")
    with pytest.raises(ValueError, match="jobs = 0 is not allowed"):
        prove(home, jobs=0)
    (home / "manifest.json").write_text("[]")
    with pytest.raises(ValueError, match="not a manifest"):
        cases_of(home)


def test_two_real_cases_from_the_command_line(tmp_path, capsys):
    trial, out = tmp_path / "trial", tmp_path / "out"
    for name, conductance in (("one", 3e-11), ("two", 0.0)):
        sealed(trial / name, conductance)
    words = ["prove", str(trial), "--results", str(out)]
    assert main([*words, "--jobs", "2"]) == 0
    told = capsys.readouterr()
    assert "effects" in told.out
    assert "[2/2]" in told.err
    verdicts = [valid_result(out / name / "out.json")["verdict"] for name in ("one", "two")]
    assert verdicts == ["effects", "none"]
    (trial / "two" / "hold.csv").unlink()
    shutil.rmtree(trial / "one")
    assert main([*words, "--fresh"]) == 3
    (line,) = (text for text in capsys.readouterr().out.splitlines() if text[:5] == "two: ")
    assert "hold.csv; copy it there" in line
