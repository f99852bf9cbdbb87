"""Whatever is asked wrongly ends as one line that names the field, and never as a traceback."""

import socket
import subprocess
from pathlib import Path

import pytest

SIMULATE = ("simulate", "--out", "OUT")


@pytest.mark.parametrize(
    ("arguments", "expected"),
    [
        ((*SIMULATE, "--fault", "bafle_crack"), ["fault:", "did you mean", "baffle_crack"]),
        ((*SIMULATE, "--fault", "zzzz"), ["fault:", "zzzz", "mirrortwin faults"]),
        ((*SIMULATE, "--fault", "baffle_crack", "--severity", "7"), ["severity:", "0 to 1", "7"]),
        ((*SIMULATE, "--fault", "baffle_crack", "--onset", "300"), ["onset_s:", "0 to 300", "300"]),
        ((*SIMULATE, "--fault", "baffle_crack", "--onset", "-1"), ["onset_s:", "-1"]),
        ((*SIMULATE, "--fault", "baffle_crack", "--cylinder", "5"), ["cylinder:", "5"]),
        ((*SIMULATE, "--altitude", "90000"), ["altitude_ft:", "2000 to 9000 ft", "90000"]),
        ((*SIMULATE, "--speed", "nan"), ["speed_kt:", "80 to 115 kt", "nan"]),
        ((*SIMULATE, "--duration", "5"), ["duration_s:", "30 to 7200 s", "5"]),
        ((*SIMULATE, "--seed", "-3"), ["seed:", "-3"]),
        ((*SIMULATE, "--severity", "high"), ["--severity", "high"]),
        ((*SIMULATE, "--plan", "missing.toml"), ["plan:", "missing.toml"]),
        (("simulate",), ["--out"]),
        (("fly",), ["fly"]),
        (("diagnose", "nowhere"), ["DIR:", "nowhere"]),
        (("diagnose", "."), ["DIR:", "faulted.parquet"]),
        (("serve", "--port", "70000"), ["port:", "1 to 65535", "70000"]),
        (
            ("serve", "--host", "192.0.2.7"),
            ["host:", "192.0.2.7", "not an address of this machine"],
        ),
        (("serve", "--scheduler", "tcp://10.0.0.5:8786"), ["scheduler:", "--tls-ca", "--insecure"]),
        (("serve", "--scheduler", "tls://10.0.0.5:8786"), ["scheduler:", "certificates"]),
        (("serve", "--tls-ca", "ca.pem"), ["scheduler:", "--scheduler"]),
        (("dataset", "--out", "OUT", "--scheduler", "10.0.0.5:8786"), ["scheduler:", "10.0.0.5"]),
        (("dataset", "--out", "OUT", "--workers", "0"), ["workers:", "0"]),
        (("dataset", "--out", "OUT", "--runs-per-class", "1"), ["runs_per_class:", "1"]),
        (("train", "--data", "nowhere", "--out", "OUT"), ["data:", "nowhere"]),
        (("bench", "--rounds", "0"), ["rounds:", "0"]),
        (("experiment", "fig99"), ["fig99", "fig6"]),
    ],
)
def test_a_bad_request_is_one_clear_line(mirrortwin, arguments, expected):
    done = mirrortwin(*arguments)
    assert done.returncode == 2
    assert done.stdout == ""
    assert len(done.stderr.splitlines()) == 1, done.stderr
    assert all(words in done.stderr for words in expected), done.stderr


@pytest.mark.parametrize(
    ("content", "expected"),
    [
        (b"altitude_ft: 5000", "not TOML"),
        (b"\xff\xfe\x00", "not TOML"),
        (b"altitude = 5000", "altitude: is not a plan field"),
        (b"altitude_ft = 90000", "altitude_ft: must lie in 2000 to 9000 ft"),
        (b"altitude_ft = 'high'", "altitude_ft: must be a number"),
        (b"weather = 3", "weather: must be a table"),
        (b"power = 'full'", "power: must be fixed or speed_hold"),
    ],
)
def test_a_bad_plan_file_is_one_clear_line(mirrortwin, tmp_path: Path, content, expected):
    (tmp_path / "plan.toml").write_bytes(content)
    done = mirrortwin(*SIMULATE, "--plan", "plan.toml")
    assert done.returncode == 2
    assert len(done.stderr.splitlines()) == 1
    assert expected in done.stderr


@pytest.mark.parametrize("out", ["/proc/flight", "file/flight"])
@pytest.mark.parametrize("name", ["simulate", "dataset"])
def test_an_out_that_cannot_be_written_is_refused_before_the_work(mirrortwin, tmp_path, name, out):
    (tmp_path / "file").touch()
    done = mirrortwin(name, "--out", out)
    assert done.returncode == 2
    assert done.stderr.startswith(f"mirrortwin: out: cannot write to {out}")


def test_a_damaged_flight_is_named(mirrortwin, tmp_path):
    for name in ("faulted", "mirror"):
        (tmp_path / f"{name}.parquet").write_bytes(b"PAR1 but not really")
    done = mirrortwin("diagnose", ".")
    assert done.returncode == 1
    assert "faulted.parquet" in done.stderr
    assert len(done.stderr.splitlines()) == 1


def test_a_taken_port_is_refused(mirrortwin):
    with socket.create_server(("127.0.0.1", 0)) as other:
        port = other.getsockname()[1]
        done = mirrortwin("serve", "--port", str(port))
    assert done.returncode == 1
    assert f"port {port} on 127.0.0.1 is taken; choose another with --port" in done.stderr
    assert "Traceback" not in done.stderr


def test_a_reader_that_has_seen_enough_is_no_error(command):
    line = f"{command} faults --json | head -n 1"
    done = subprocess.run(line, shell=True, capture_output=True, text=True, check=False)
    assert (done.stdout, done.stderr) == ("[\n", "")
