"""mbpoll, a Modbus master nobody here wrote, as a function."""

import re
import subprocess


def mbpoll(link, table, address, values=None, count=1, unit=1, kind="float", tries=1, patience_s=10):
    """Reads `count` values (or writes `values`) at a PDU address. kind: float, int (32 bits) or word.

    Returns the numbers, or raises AssertionError with what mbpoll printed. `tries`: how often a time-out is
    forgiven, for a line that loses characters."""
    kinds = {"float": ":float", "int": ":int", "word": ""}
    number = {"holding": "4", "input": "3"}[table] + kinds[kind]
    command = ["mbpoll", "-m", "rtu", "-a", str(unit), "-b", "115200", "-d", "8", "-s", "1", "-P", "even", "-0", "-B",
               "-t", number, "-r", str(address), "-1", "-o", str(patience_s)]
    command += ["-c", str(count)] if values is None else []
    command += [str(link)] + ([str(v) for v in values] if values is not None else [])
    for attempt in range(tries):
        done = subprocess.run(command, capture_output=True, text=True, timeout=60)
        if done.returncode == 0 and "failed" not in done.stdout + done.stderr:
            return [float(m) for m in re.findall(r"^\[\d+\]:\s+(\S+)", done.stdout, re.MULTILINE)]
        if "timed out" not in done.stdout + done.stderr and "Invalid" not in done.stdout + done.stderr:
            break
    raise AssertionError(f"{' '.join(command)}\n{done.stdout}{done.stderr}")
