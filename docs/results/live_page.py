#!/usr/bin/env python3
"""What the live page costs a session: pairs of the same simulated session at real pace, one without
and one with a page that many clients look at; the section "The live page" of docs/results.md.

live_page.py GONIO OUT_FOLDER [--pairs 3] [--clients 10] [--time-scale 1] [--basis FILE]

Every client does what the page does once a second: asks for the state, new points and the last frame.
Prints the wall time of every run, the mean of each kind, and the run-to-run spread of those without.
"""
import argparse
import http.client
import json
import os
import re
import statistics
import subprocess
import threading
import time
import urllib.parse

RIG = """[simulation]
time_scale = {scale}
lamp_drift_sigma = 0.0
homing_sigma_deg = 0.0
positioning_sigma_deg = 0.0
same_noise_again = true
"""
PLAN = "theta_h_deg,theta_d_deg,phi_d_deg\n3,12,28\n39,60,89\n15,30,130\n2,60,100\n20,20,60\n"


class Client(threading.Thread):
    """A page that somebody has open."""

    def __init__(self, address, over):
        super().__init__(daemon=True)
        self.address = address
        self.over = over
        self.answers = 0
        self.bytes = 0
        self.failures = 0

    def get(self, path):
        connection = http.client.HTTPConnection(self.address, timeout=10)
        connection.request("GET", path)
        reply = connection.getresponse()
        body = reply.read()
        connection.close()
        self.answers += 1
        self.bytes += len(body)
        return body

    def run(self):
        points = frame = sphere = 0
        while not self.over.is_set():
            try:
                state = json.loads(self.get("/state.json"))
                if state["points_told"] > points:
                    points += len(json.loads(self.get(f"/points.json?from={points}"))["points"])
                if state["frame"] and state["frame"]["id"] != frame:
                    frame = state["frame"]["id"]
                    self.get("/frame.png")
                if state["reconstruction"]["number"] != sphere:
                    sphere = state["reconstruction"]["number"]
                    self.get("/sphere.png")
                if state["is_over"]:
                    return
            except (OSError, http.client.HTTPException):
                if not self.over.is_set():
                    self.failures += 1
            self.over.wait(1.0)


def processor_s(before):
    after = os.times()
    return after.children_user + after.children_system - before.children_user - before.children_system


def session(options, number, watched):
    """Seconds on the wall from the program's start to the archive's last write: the session. The program
    itself then lets pages that are open see the end, for at most 2.5 s."""
    out = os.path.join(options.out, f"session-{number}")
    command = [options.gonio, "measure", "rig.toml", "--plan", "plan.csv", "--material",
               "builtin:gold-satin", "--out", os.path.abspath(out), "--seed", "1"]
    if watched:
        command += ["--monitor", "0"]
        command += ["--basis", os.path.abspath(options.basis)] if options.basis else []
    before = os.times()
    begin = time.time()
    process = subprocess.Popen(command, cwd=options.out, stderr=subprocess.PIPE, text=True)
    over = threading.Event()
    clients = []
    for line in process.stderr:
        found = re.search(r"http://\S+", line)
        if found and not clients:
            address = urllib.parse.urlparse(found.group()).netloc
            clients = [Client(address, over) for _ in range(options.clients)]
            for client in clients:
                client.start()
    code = process.wait()
    whole = time.time() - begin
    over.set()
    for client in clients:
        client.join()
    if code != 0:
        raise SystemExit(f"gonio measure: exit code {code}")
    seconds = os.stat(os.path.join(out, "session.sqlite")).st_mtime - begin
    answers = sum(client.answers for client in clients)
    failures = sum(client.failures for client in clients)
    volume = sum(client.bytes for client in clients)
    kind = "with" if watched else "without"
    print(f"{kind:8} session {seconds:8.3f} s, program {whole:8.3f} s, processor {processor_s(before):6.2f} s; "
          f"{answers} answers, {volume / 1e6:.1f} MB, {failures} refused (the program had ended)", flush=True)
    if watched and (answers == 0 or len(clients) != options.clients):
        raise SystemExit("nobody looked on")
    return seconds


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("gonio")
    parser.add_argument("out")
    parser.add_argument("--pairs", type=int, default=3)
    parser.add_argument("--clients", type=int, default=10)
    parser.add_argument("--time-scale", type=float, default=1.0)
    parser.add_argument("--basis", default="")
    options = parser.parse_args()
    options.gonio = os.path.abspath(options.gonio)
    os.makedirs(options.out)
    with open(os.path.join(options.out, "rig.toml"), "w", encoding="utf-8") as file:
        file.write(RIG.format(scale=options.time_scale))
    with open(os.path.join(options.out, "plan.csv"), "w", encoding="utf-8") as file:
        file.write(PLAN)
    version = subprocess.run([options.gonio, "--version"], capture_output=True, text=True, check=True)
    print(f"{version.stdout.strip()}; {os.cpu_count()} processors, load {os.getloadavg()[0]:.1f}; "
          f"{options.clients} clients, time scale {options.time_scale:g}")
    times = {False: [], True: []}
    for pair in range(options.pairs):
        # Which comes first changes, so that a load that grows does not count for one of them.
        for watched in ((False, True) if pair % 2 == 0 else (True, False)):
            times[watched].append(session(options, 2 * pair + watched, watched))
    without, watched = (statistics.fmean(times[kind]) for kind in (False, True))
    spread = max(times[False]) - min(times[False])
    print(f"without {without:.3f} s, with {watched:.3f} s: {100 * (watched / without - 1):+.3f} %; "
          f"run to run without {100 * spread / without:.3f} % (largest minus smallest)")


if __name__ == "__main__":
    main()
