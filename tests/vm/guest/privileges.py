"""Who may do what."""

import installation
from lab import CONTROL_SOCKET, STATUS_SOCKET, check, configure, expect, must, run


def prepare():
    configure(installation.SIMPLE)
    must("useradd", "--no-create-home", "stranger")
    must("useradd", "--no-create-home", "--groups", "haptic", "member")


def finish():
    must("userdel", "stranger")
    must("userdel", "member")


@check("an unprivileged user reads the status")
def stranger_reads():
    said = must("hapticctl", "status", user="stranger")
    expect("force loop" in said, said)


@check("an unprivileged user changes nothing and is told which group it takes")
def stranger_changes_nothing():
    for command in (("engage",), ("set", "force.stiffness_n_per_m=400")):
        done = run("hapticctl", *command, user="stranger")
        expect(done.returncode != 0 and "haptic" in done.stdout, f"{command}: {done.returncode} {done.stdout}")
    done = run("hapticctl", "--socket", STATUS_SOCKET, "engage", user="stranger")
    expect(done.returncode != 0, done.stdout)
    expect("500" in must("hapticctl", "get", "force.stiffness_n_per_m"), "the value changed")


@check("a member of the group haptic changes parameters and engages")
def member_changes():
    must("hapticctl", "set", "force.stiffness_n_per_m=400", user="member")
    expect("400" in must("hapticctl", "get", "force.stiffness_n_per_m", user="stranger"), "not set")
    must("hapticctl", "engage", user="member")
    must("hapticctl", "disengage", user="member")


@check("device nodes belong to the daemon's group and to nobody else")
def sockets():
    expect(must("stat", "-c", "%a %G", CONTROL_SOCKET).strip() == "660 haptic", must("stat", CONTROL_SOCKET))
    expect(must("stat", "-c", "%a", STATUS_SOCKET).strip() == "666", must("stat", STATUS_SOCKET))
    expect(must("stat", "-c", "%a %G", "/dev/cpu_dma_latency").strip() == "660 hapticd",
           must("stat", "/dev/cpu_dma_latency"))
