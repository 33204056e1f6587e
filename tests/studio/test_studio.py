"""The local page: who may ask, what each step does, and the whole way in a browser."""

from __future__ import annotations

import contextlib
import http.client
import io
import json
import os
import re
import shutil
import signal
import subprocess
import sys
import threading
import time
import zipfile
from collections.abc import Iterator
from pathlib import Path
from typing import Any, NamedTuple
from urllib.parse import quote, urlsplit

import numpy as np
import pytest

from pamrs.cli import main
from pamrs.errors import ParameterError
from pamrs.recordings import propose
from pamrs.studio import Studio, serve
from pamrs.studio._app import sparkline
from tests.studio.browser import CHROMIUM, Browser

EXAMPLE = Path(__file__).parents[2] / "python/pamrs/cli/example_files/shoulder"
RIG = (EXAMPLE / "rig.toml").read_text(encoding="utf-8")


def shortened(name: str, seconds: float = 5.0) -> bytes:
    """A recording of the example, its beginning only."""
    head, *rows = (EXAMPLE / name).read_text(encoding="utf-8").splitlines()
    kept = [row for row in rows if float(row.split(",")[0]) < seconds]
    assert 100 < len(kept) < len(rows)
    return "\n".join([head, *kept, ""]).encode()


class Answer(NamedTuple):
    """What the page answers; names of headers are in small letters."""

    status: int
    headers: dict[str, str]
    content: bytes

    @property
    def text(self) -> str:
        return self.content.decode()


class Page:
    """A page that is served, asked as a browser would."""

    def __init__(self, address: str, studio: Studio) -> None:
        self.address, self.studio = address, studio
        parts = urlsplit(address)
        assert parts.hostname == "127.0.0.1"
        self.port, self.token = parts.port, parts.query.removeprefix("token=")
        self.cookie = f"pamrs_studio_{self.port}={self.token}"

    def ask(self, method: str, path: str, body: bytes | None = None, **headers: str) -> Answer:
        sent = {"Cookie": self.cookie, "X-Pamrs-Token": self.token}
        sent |= {name.replace("_", "-"): value for name, value in headers.items()}
        with contextlib.closing(http.client.HTTPConnection("127.0.0.1", self.port)) as link:
            link.request(method, path, body, {k: v for k, v in sent.items() if v})
            with link.getresponse() as told:
                return Answer(told.status, dict(told.headers.items()), told.read())

    def get(self, path: str = "/") -> str:
        answer = self.ask("GET", path)
        assert answer.status == 200
        return answer.text

    def press(self, what: str, **given: Any) -> str:
        """Press a button; the error that is told."""
        return self.send(f"/{what}", json.dumps(given).encode())

    def upload(self, name: str, content: bytes) -> str:
        return self.send(f"/upload?name={quote(name)}", content)

    def send(self, path: str, body: bytes) -> str:
        answer = self.ask("POST", path, body)
        told = json.loads(answer.content)
        assert answer.status == (400 if told else 200)
        return str(told.get("error", ""))

    def as_proposed(self) -> list[dict[str, Any]]:
        """What the page sends where nothing is corrected."""
        found = []
        for table in self.studio.tables()[0]:
            columns = {
                one["column"]: [name, one["unit"]]
                for name, one in table.entries[0]["channels"].items()
            }
            found.append({"role": table.role, "columns": columns})
        return found


def begun(page: Page, *names: str, seconds: float = 5.0) -> None:
    """The rig of the example and recordings of it, as a.csv and b.csv."""
    page.press("rig", text=RIG)
    for log, name in zip("ab", names, strict=False):
        assert page.upload(f"{log}.csv", shortened(name, seconds)) == ""


@pytest.fixture
def page(tmp_path: Path) -> Iterator[Page]:
    with served(Studio(tmp_path / "case")) as found:
        yield found


@contextlib.contextmanager
def served(studio: Studio) -> Iterator[Page]:
    """The page of a case folder, as it is served; in a thread, which signals do not reach."""
    import uvicorn

    opened, told = threading.Event(), list[str]()
    servers = list[uvicorn.Server]()
    run = uvicorn.Server.run

    def kept(server: uvicorn.Server, *given: Any, **named: Any) -> None:
        servers.append(server)
        run(server, *given, **named)

    def ready(address: str) -> None:
        told.append(address)
        opened.set()

    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(uvicorn.Server, "run", kept)
        thread = threading.Thread(target=serve, args=(studio,), kwargs={"ready": ready})
        thread.start()
        assert opened.wait(20)
        try:
            yield Page(told[0], studio)
        finally:
            while not servers:
                time.sleep(0.01)
            servers[0].should_exit = True
            thread.join(20)
    assert not thread.is_alive()


def test_nobody_is_let_in_without_the_token(page: Page) -> None:
    first = page.ask("GET", f"/?token={page.token}", Cookie="")
    cookie = first.headers["set-cookie"]
    assert (first.status, first.headers["location"]) == (303, "/")
    assert cookie.startswith(page.cookie)
    assert "httponly" in cookie.lower()
    assert "samesite=strict" in cookie.lower()
    for path in ("/", "/?token=x", "/?token=%C3%A9", "/static/studio.js", "/progress", "/case.zip"):
        assert page.ask("GET", path, Cookie="").status == 403
        wrong = page.cookie[:-1] + ("a" if page.cookie[-1] != "a" else "b")
        assert page.ask("GET", path, Cookie=wrong).status == 403
    assert page.ask("POST", "/packaged", b'{"name": "shoulder"}', X_Pamrs_Token="").status == 403
    assert page.ask("POST", "/packaged", b'{"name": "shoulder"}', Cookie="").status == 403
    assert page.studio.empty()


def test_other_hosts_and_origins_are_refused(page: Page) -> None:
    for host in ("evil.example", f"evil.example:{page.port}", "127.0.0.1", "127.0.0.1:1"):
        assert page.ask("GET", "/", Host=host).status == 403
    for origin in ("http://evil.example", "null", f"http://127.0.0.1:{page.port + 1}"):
        assert page.ask("POST", "/check", b"{}", Origin=origin).status == 403
    own = page.ask("POST", "/check", b"{}", Origin=f"http://127.0.0.1:{page.port}")
    assert own.status == 200


def test_the_page_may_load_nothing_from_elsewhere(page: Page) -> None:
    answer = page.ask("GET", "/")
    policy = answer.headers["content-security-policy"]
    assert "default-src 'none'" in policy
    assert answer.headers["referrer-policy"] == "no-referrer"
    assert not re.search("https?://", answer.text)


def test_links_lead_nowhere_out_of_the_folder(page: Page, tmp_path: Path) -> None:
    prepared(page)
    outside = tmp_path / "outside"
    outside.mkdir()
    (outside / "rig.toml").write_text("kept by somebody")
    (outside / "report.html").write_text("secret")
    (page.studio.folder / "result").symlink_to(outside)
    assert "result: lies outside the case folder" in page.press("run")
    assert page.ask("GET", "/result/report.html").status == 404
    for name, what in (("rig.toml", "rig"), ("case.toml", "case")):
        (page.studio.folder / name).unlink()
        (page.studio.folder / name).symlink_to(outside / "rig.toml")
        assert "lies outside the case folder" in page.press(what, text="written")
    assert "kept by somebody" not in page.get()
    assert (outside / "rig.toml").read_text() == "kept by somebody"
    assert sorted(file.name for file in outside.iterdir()) == ["report.html", "rig.toml"]


def test_nothing_else_of_the_disk_is_reached(page: Page, tmp_path: Path) -> None:
    (tmp_path / "secret.csv").write_text("time [s],x\n0,1\n")
    result = page.studio.folder / "result"
    result.mkdir()
    (result / "report.html").symlink_to(tmp_path / "secret.csv")
    for path in (
        *("/result/report.html", "/result/..%2f..%2fsecret.csv", "/result/rig.toml"),
        *("/static/..%2f_app.py", "/static/_app.py", "/../secret.csv"),
    ):
        assert page.ask("GET", path).status == 404
    (page.studio.folder / "rig.toml").symlink_to(tmp_path / "secret.csv")
    assert "lies outside the case folder" in page.get()
    assert "time [s],x" not in page.get()
    with zipfile.ZipFile(io.BytesIO(page.ask("GET", "/case.zip").content)) as packed:
        assert packed.namelist() == []


@pytest.mark.parametrize("name", ["../a.csv", "..\\a.csv", "/tmp/x/a.csv", ".a.csv", "../.a.csv"])
def test_of_an_uploaded_name_only_the_last_part_counts(page: Page, name: str) -> None:
    assert page.upload(name, shortened("multisine.csv", 1.0)) == ""
    assert [file.name for file in page.studio.folder.iterdir()] == ["a.csv"]


@pytest.mark.parametrize("name", ["", "..", "/", "rig.toml", "x/case.toml", "\0"])
def test_names_that_no_log_has_are_refused(page: Page, name: str) -> None:
    assert page.upload(name, b"1,2\n")
    assert page.studio.empty()


def test_what_cannot_be_read_is_not_kept(page: Page) -> None:
    assert "the format '.exe' is not read here" in page.upload("a.exe", b"MZ")
    assert page.upload("a.csv", b"")
    assert page.studio.empty()
    assert page.upload("a.csv", shortened("multisine.csv", 1.0)) == ""
    assert "is there already" in page.upload("a.csv", b"other")
    assert (page.studio.folder / "a.csv").read_bytes() == shortened("multisine.csv", 1.0)


def test_too_much_is_refused_and_leaves_nothing(
    page: Page, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("pamrs.studio._app.MOST_BYTES", 1 << 20)
    assert "more than 1 MB" in page.upload("a.csv", bytes(3 << 20))
    assert page.studio.empty()


def test_a_wrong_rig_is_told_and_can_be_mended(page: Page) -> None:
    assert page.press("rig", text=RIG.replace("[muscle]", "[<b>muscle</b>]")) == ""
    text = page.get()
    assert "<b>muscle" not in text
    assert "rig.toml" in text
    assert page.studio.rig()[1]
    assert page.press("rig", text=RIG) == ""
    assert page.studio.rig()[1] == ""
    assert page.press("packaged", name="no such") != ""
    assert page.press("packaged", name="bench") == ""
    assert page.studio.rig()[0] is not None


def test_run_is_locked_until_the_check_is_green(page: Page) -> None:
    assert "run is locked" in page.press("run")
    page.press("check")
    assert page.studio.checked is not None
    assert page.studio.checked.error == "there is no rig yet"
    begun(page, "multisine.csv")
    page.press("check")
    assert page.studio.checked.error == "channels and units are not confirmed yet"
    assert page.press("confirm", logs=page.as_proposed()) == ""
    assert "run is locked" in page.press("run")
    page.press("check")
    assert page.studio.green
    page.press("rig", text=RIG)
    assert not page.studio.green
    assert "run is locked" in page.press("run")
    page.press("case", text="schema = 1")
    page.press("check")
    assert not page.studio.green
    assert "case.toml" in page.studio.checked.error
    assert page.studio.run is None


def test_what_was_corrected_is_written_and_shown_again(page: Page) -> None:
    page.press("rig", text=RIG)
    head, _, rows = shortened("multisine.csv", 2.0).decode().partition("\n")
    odd = '<img src="x">'
    names = [name.split(" ")[0].replace("muscle_pressure", odd) for name in head.split(",")]
    quoted = ",".join('"' + name.replace('"', '""') + '"' for name in names)
    assert page.upload("a.csv", f"{quoted}\n{rows}".encode()) == ""
    assert page.upload("b.csv", shortened("angle_steps.csv", 2.0)) == ""
    assert "<img" not in page.get()
    logs = page.as_proposed()
    logs[0]["columns"] |= {odd: ["muscle_pressure", "kPa"], "joint_angle": ["joint_angle", "deg"]}
    logs[0]["columns"] |= {"supply_pressure": ["supply_pressure", "bar(a)"]}
    logs[0]["columns"] |= {"valve_command": ["valve_command", ""]}
    assert "valve_command: a unit is needed" in page.press("confirm", logs=logs)
    logs[0]["columns"]["valve_command"] = ["muscle_pressure", "V"]
    assert "cannot both be it" in page.press("confirm", logs=logs)
    logs[0]["columns"]["valve_command"] = ["valve_command", "V"]
    logs[1]["role"] = ""
    assert page.press("confirm", logs=logs) == ""
    entries = page.studio.tables()[0]
    assert entries[0].channel(odd) == ("muscle_pressure", {"column": odd, "unit": "kPa"})
    assert [table.entries[0]["role"] for table in entries] == ["fit", ""]
    assert 'value="kPa"' in page.get()
    case = (page.studio.folder / "case.toml").read_text(encoding="utf-8")
    assert "b.csv" not in case
    assert "bar(a)" in case
    again = Studio(page.studio.folder)  # the folder opened another time
    assert again.tables()[0][0].channel(odd)[1]["unit"] == "kPa"


def test_what_a_diagnosis_would_refuse_is_red_already(page: Page) -> None:
    begun(page, "multisine.csv")

    def error(**changed: list[str]) -> str:
        logs = page.as_proposed()
        logs[0]["columns"] |= changed
        assert page.press("confirm", logs=logs) == ""
        page.press("check")
        assert page.studio.checked is not None
        return page.studio.checked.error

    assert "do not surround any block" in error(joint_angle=["", ""])
    assert "joint_angle" in error(joint_angle=["joint_angle", "rad"])
    assert error(joint_angle=["joint_angle", "deg"]) == ""


def test_a_unit_that_was_assumed_is_confirmed(page: Page) -> None:
    page.press("rig", text=RIG)
    head, _, rows = shortened("multisine.csv", 2.0).decode().partition("\n")
    bare = ",".join(name.partition(" ")[0] for name in head.split(","))
    page.upload("a.csv", f"{bare}\n{rows}".encode())
    assert "assumed: " in page.get()
    assert page.press("confirm", logs=page.as_proposed()) == ""
    assert "assumed" not in page.studio.text("case.toml")
    assert "assumed: " not in page.get()


def test_a_log_without_a_clock_gets_one(page: Page) -> None:
    page.press("rig", text=RIG)
    rows = shortened("multisine.csv", 2.0).decode().splitlines()
    page.upload("a.csv", "\n".join(row.partition(",")[2] for row in rows).encode())
    assert 'class="spacing"' in page.get()
    logs = page.as_proposed()
    assert page.press("confirm", logs=logs) == ""
    page.press("check")
    assert not page.studio.green
    logs[0]["sample_time"] = "5 bar"
    assert "spacing = '5 bar' is not allowed" in page.press("confirm", logs=logs)
    logs[0]["sample_time"] = "5 ms"
    assert page.press("confirm", logs=logs) == ""
    assert 'value="0.005 s"' in page.get()
    page.press("check")
    assert page.studio.green


def test_a_log_is_read_once_until_it_or_the_rig_changes(
    page: Page, monkeypatch: pytest.MonkeyPatch
) -> None:
    read = list[str]()

    def counted(paths: list[Path], rig: Any) -> Any:
        read.append(f"{paths[0].name} {rig and rig.name}")
        return propose(paths, rig)

    monkeypatch.setattr("pamrs.studio._folder.propose", counted)
    begun(page, "multisine.csv", "angle_steps.csv", seconds=2.0)
    page.press("confirm", logs=page.as_proposed())
    page.get()
    assert read == ["a.csv shoulder", "b.csv shoulder"]
    page.press("packaged", name="bench")
    page.get()
    assert read[2:] == ["a.csv bench", "b.csv bench"]
    (page.studio.folder / "a.csv").write_bytes(shortened("multisine.csv", 1.0))
    page.press("rig", text=page.studio.text("rig.toml"))
    page.get()
    assert read[4:] == ["a.csv bench"]


def test_parts_of_a_log_keep_their_roles(page: Page) -> None:
    page.press("rig", text=RIG)
    head, *rows = shortened("multisine.csv", 4.0).decode().splitlines()
    moved = []
    for number, row in enumerate(rows):  # three pauses of half a minute
        time_, _, rest = row.partition(",")
        moved.append(f"{float(time_) + 30.0 * (number // 200)},{rest}")
    page.upload("a.csv", "\n".join([head, *moved, ""]).encode())
    (table,) = page.studio.tables()[0]
    assert [entry["role"] for entry in table.entries] == ["fit", "held_out"]
    assert '<option value="parts" selected>' in page.get()

    def confirmed(role: str) -> list[tuple[str, list[int] | None]]:
        logs = page.as_proposed()
        logs[0]["role"] = role
        assert page.press("confirm", logs=logs) == ""
        page.press("check")
        assert page.studio.green
        entries = page.studio.tables()[0][0].entries
        return [(entry["role"], entry.get("pieces")) for entry in entries]

    for _ in range(2):  # there and back
        assert confirmed("parts") == [("fit", [1, 2, 3]), ("held_out", [4])]
        assert confirmed("fit") == [("fit", None)]
    assert "role = 'x' is not allowed" in page.press("confirm", logs=[{"role": "x"}])


def test_a_log_of_the_folder_that_cannot_be_read_does_not_hide_the_others(page: Page) -> None:
    (page.studio.folder / "notes.txt").write_text("valve changed <b>on Monday</b>\n")
    begun(page, "multisine.csv", seconds=2.0)
    text = page.get()
    assert "notes.txt" in text
    assert "<b>on" not in text
    assert [table.key[0] for table in page.studio.tables()[0]] == ["a.csv"]


def test_a_request_that_is_no_table_is_an_error(page: Page) -> None:
    for body in (b"[]", b"{", b"\xff", b'{"logs": 3}', b'{"logs": [3]}'):
        assert page.send("/confirm", body)


def test_a_case_that_was_there_is_used_and_kept(tmp_path: Path) -> None:
    folder = tmp_path / "case"
    shutil.copytree(EXAMPLE, folder)
    studio = Studio(folder)
    before = studio.text("case.toml")
    assert studio.foreign
    assert studio.check().error == ""
    assert studio.green
    with served(studio) as page:
        assert "There is a case.toml already" in page.get()
        assert page.press("confirm", logs=page.as_proposed()) == ""
    assert (folder / "case_before.toml").read_text(encoding="utf-8") == before
    assert not studio.foreign
    assert studio.check().error == ""


def test_a_diagnosis_is_cancelled_at_once(page: Page) -> None:
    with pytest.raises(ParameterError, match="locked"):
        page.studio.start()
    prepared(page)
    assert page.press("run") == ""
    assert "goes on" in page.press("run")
    assert "goes on" in page.press("rig", text="")
    assert json.loads(page.get("/progress"))["running"]
    page.press("cancel")
    told = json.loads(page.get("/progress"))
    assert (told["running"], told["error"]) == (False, "cancelled")
    assert "cancelled" in page.get()
    assert not (page.studio.folder / "result").exists()
    assert {f.name for f in page.studio.folder.iterdir()} == {
        *("rig.toml", "case.toml", "a.csv", "b.csv")
    }


def prepared(page: Page) -> None:
    """A case that is checked."""
    begun(page, "multisine.csv", "angle_steps.csv")
    assert page.press("confirm", logs=page.as_proposed()) == ""
    page.press("check")
    assert page.studio.green


def test_the_whole_way(page: Page) -> None:
    prepared(page)
    assert page.press("run") == ""
    leading: list[str] = []
    while (told := json.loads(page.get("/progress")))["running"]:
        leading = told["leading"] or leading
        time.sleep(0.2)
    assert told["error"] == ""
    assert any("muscle leak" in text for text in page.studio.run.leading)  # type: ignore[union-attr]
    found, error = page.studio.result()
    assert found is not None
    assert error == ""
    assert [effect.id for effect in found.effects] == ["leak_muscle"]
    text = page.get()
    assert "leak of the muscle" in text
    assert found.next_experiment.text[:40] in text
    assert "Made from other files" not in text
    report = page.ask("GET", "/result/report.html")
    assert "sandbox allow-scripts;" in report.headers["content-security-policy"]
    assert "<html" in report.text
    assert "attachment" in (page.ask("GET", "/result/model.toml").headers["content-disposition"])
    with zipfile.ZipFile(io.BytesIO(page.ask("GET", "/case.zip").content)) as packed:
        names = {name.removeprefix("case/") for name in packed.namelist()}
    assert names >= {"rig.toml", "case.toml", "a.csv", "b.csv", "result/report.html"}
    page.press("rig", text=RIG + "\n")
    page.press("check")
    assert "Made from other files" in page.get()


@pytest.mark.slow
def test_the_next_experiment_is_there_to_take(tmp_path: Path) -> None:
    bench, folder = EXAMPLE.parent / "bench", tmp_path / "case"
    shutil.copytree(bench, folder, ignore=shutil.ignore_patterns("map.csv"))
    rig = str(folder / "rig.toml")
    assert main(["fit", "map", str(bench / "map.csv"), "--muscle", rig, "--rig", rig]) == 0
    with served(Studio(folder)) as page:
        assert page.press("confirm", logs=page.as_proposed()) == ""
        page.press("check")
        assert page.press("run") == ""
        while json.loads(page.get("/progress"))["running"]:
            time.sleep(0.2)
        assert 'href="/result/experiment.csv"' in page.get()
        head, *rows = page.get("/result/experiment.csv").splitlines()
    assert head.startswith("time")
    assert len(rows) > 100


@pytest.mark.slow
@pytest.mark.skipif(CHROMIUM is None, reason="no Chromium is installed")
def test_in_a_browser(page: Page, tmp_path: Path) -> None:
    logs = [tmp_path / "a.csv", tmp_path / "b.csv"]
    for log, name in zip(logs, ("multisine.csv", "angle_steps.csv"), strict=True):
        log.write_bytes(shortened(name))

    def state(step: str) -> str:
        return f"document.querySelector('#{step} .state').textContent.trim()"

    with Browser(tmp_path / "profile") as browser:
        browser.open(page.address)
        assert page.token not in browser.run("location.href")
        assert browser.run("document.querySelector('[data-do=run]').disabled")
        browser.choose("#rigfile", [EXAMPLE / "rig.toml"])
        browser.until(f"{state('rig')} === 'valid'")
        browser.choose("#logs", logs)
        browser.until("document.querySelectorAll('.log').length === 2")
        assert browser.run("document.querySelectorAll('.log polyline').length") == 10
        browser.click("[data-do=confirm]")
        browser.until(f"{state('data')} === 'confirmed'")
        browser.click("[data-do=check]")
        browser.until(f"{state('check')} === 'green'")
        browser.click("[data-do=run]")
        browser.until(f"{state('result')} === 'there'")
        assert "leak" in browser.run("document.querySelector('#result .lead').textContent")
        for width in (1400, 500):
            browser.picture(tmp_path / f"{width}.png", width)
            assert browser.run("document.documentElement.scrollWidth") <= width
        assert browser.logged == []
        own = page.address.partition("?")[0]
        assert [url for url in browser.asked if not url.startswith((own, "data:"))] == []


def test_ctrl_c_ends_it_plainly(tmp_path: Path) -> None:
    words = [sys.executable, "-m", "pamrs", "studio", str(tmp_path / "case"), "--no-browser"]
    with subprocess.Popen(
        words, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True, env=dict(os.environ)
    ) as process:
        assert process.stdout is not None
        line = process.stdout.readline()
        assert line.startswith("open http://127.0.0.1:")
        time.sleep(0.5)
        process.send_signal(signal.SIGINT)
        out, err = process.communicate(timeout=20)
    assert process.returncode == 0
    assert out == f"case folder: {tmp_path / 'case'}\n"
    assert "Traceback" not in err


def test_a_missing_package_is_named_before_anything_is_made(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    for name in [name for name in sys.modules if name.startswith("pamrs.studio")]:
        monkeypatch.delitem(sys.modules, name)
    monkeypatch.setitem(sys.modules, "uvicorn", None)
    assert main(["studio", str(tmp_path / "case")]) == 2
    assert "pip install 'pamrs[studio]'" in capsys.readouterr().err
    assert not (tmp_path / "case").exists()


def test_a_port_that_is_taken_is_an_error(page: Page, tmp_path: Path) -> None:
    with pytest.raises(ParameterError, match=f"port = {page.port}: cannot be opened"):
        serve(Studio(tmp_path / "other"), page.port)


def test_curves_show_the_extremes_and_no_holes() -> None:
    values = np.zeros(100_000)
    values[50_003] = 1.0
    values[70_000:80_000] = np.nan
    text = str(sparkline(values))
    heights = [float(point.split(",")[1]) for point in text.split('points="')[1].split()[:-1]]
    assert min(heights) == 2.0
    assert max(heights) == 34.0
    assert len(text) < 10_000
    assert "nan" not in text
    assert str(sparkline(np.full(5, np.nan))) == ""
    assert "<polyline" in str(sparkline(np.ones(1)))
