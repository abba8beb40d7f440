#!/usr/bin/env python3
"""Runs the command on inputs that mean harm, each with 10 s of processor time and 1 GB, and compares what it says.

    hostile_test.py --carom PATH --source REPOSITORY [--only TEXT] [--show]

Each case of the table is an input, a part of the sentence that is expected of it, and the exit code. Besides, no case may
end by a signal, say more than a few lines on stderr, or leave a file behind after a refusal. Exit status: 1 if one differs.
"""
import argparse
import concurrent.futures
import os
import resource
import subprocess
import sys
import tempfile
from pathlib import Path

from cases import all_cases

CPU_SECONDS = 10
MEMORY = 1 << 30  # bytes of address space


def limit():
    resource.setrlimit(resource.RLIMIT_CPU, (CPU_SECONDS, CPU_SECONDS))
    resource.setrlimit(resource.RLIMIT_AS, (MEMORY, MEMORY))
    resource.setrlimit(resource.RLIMIT_CORE, (0, 0))


def files_below(folder):
    return {path.relative_to(folder).as_posix() for path in folder.rglob("*") if not path.is_dir()}


def run(case, carom):
    """Returns what is wrong, and what the command said."""
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        case.prepare(folder)
        before = files_below(folder)
        done = subprocess.run([carom, *case.arguments], cwd=folder, stdin=subprocess.DEVNULL, capture_output=True, preexec_fn=limit,
                              env={**os.environ, "HOME": name, "XDG_CACHE_HOME": name + "/cache"}, check=False)
        said = (done.stderr + done.stdout).decode(errors="replace")
        faults = []
        if done.returncode != case.code:
            faults.append(f"exit code {done.returncode}, expected {case.code}")
        if case.sentence not in said:
            faults.append(f"does not say {case.sentence!r}")
        if len(done.stderr.splitlines()) > case.most_lines:
            faults.append(f"{len(done.stderr.splitlines())} lines on stderr")
        left = files_below(folder) - before
        if case.code in (1, 2) and not case.leaves and left:
            faults.append(f"left {sorted(left)} behind")
        return faults, said


def main():
    parser = argparse.ArgumentParser()
    parser.add_argument("--carom", required=True)
    parser.add_argument("--source", required=True, type=Path)
    parser.add_argument("--only", default="")
    parser.add_argument("--show", action="store_true", help="print what each says")
    arguments = parser.parse_args()
    cases = [case for case in all_cases(arguments.source) if arguments.only in case.name]
    names = [case.name for case in cases]
    failed = len(names) - len(set(names))
    if failed:
        print("two cases have one name:", sorted({name for name in names if names.count(name) > 1}))
    carom = str(Path(arguments.carom).resolve())
    with concurrent.futures.ThreadPoolExecutor(os.cpu_count()) as pool:
        for case, (faults, said) in zip(cases, pool.map(lambda case: run(case, carom), cases)):
            if arguments.show:
                print(f"{case.name}: {said.strip()[:400]}")
            for fault in faults:
                failed += 1
                print(f"{case.name}: {fault}\n    {said.strip()[:600]}")
    print(f"{len(cases)} hostile inputs, {failed} faults")
    return 1 if failed or (not arguments.only and len(cases) < 150) else 0


if __name__ == "__main__":
    sys.exit(main())
