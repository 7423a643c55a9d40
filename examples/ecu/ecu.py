"""An estimator behind CAN frames, in Python: the slope by accelerometer and wheels. Lines of candump in and out."""
import math
import sys

G, TAU = 9.81, 0.5                                    # m/s²; time constant of the low-pass, s
speed = slow_speed = accel = slow_accel = 0.0
last, answer, seen = None, "", set()                  # seen: the samples that came for this step


def number(data: bytes, at: int, step: float) -> float:
    """The fixed-point number in three bytes, behind a stamp in five."""
    return int.from_bytes(data[at:at + 3], "little", signed=True) * step


def frame(identifier: int, *fields: tuple[float, int]) -> str:
    """A frame of raw numbers, each with its bits."""
    raw = at = 0
    for value, bits in fields:
        raw |= (round(value) & (1 << bits) - 1) << at
        at += bits
    mark, size = ("##0", 16) if at > 64 else ("#", 8)
    return f"(0.0) can0 {identifier:03X}{mark}{raw.to_bytes(size, 'little').hex().upper()}\n"


for line in sys.stdin:
    identifier, data = line.split()[2].replace("##0", "#").split("#")
    identifier, data = int(identifier, 16), bytes.fromhex(data)
    seen.add(identifier)
    if identifier == 0x100:                           # specific_force: the axis along the train
        accel = number(data, 5, 1e-5)
    elif identifier == 0x130:                         # wheel_speed_drive_1
        speed = number(data, 5, 1e-5)
    elif identifier == 0x220:                         # step: all of it has come
        dt = int.from_bytes(data[5:8], "little") * 1e-6
        start, sequence = data[8] & 1, int.from_bytes(data[8:10], "little") >> 1
        if start:
            accel, speed = accel * (0x100 in seen), speed * (0x130 in seen)   # else of another run
            slow_speed, slow_accel, last = speed, accel, None
        seen.clear()
        if sequence != last:                          # else the answer was lost: the same again
            slow_speed += (speed - slow_speed) * min(dt / TAU, 1)
            slow_accel += (accel - slow_accel) * min(dt / TAU, 1)
            sine = (slow_accel - (speed - slow_speed) / TAU) / G
            slope, end = math.asin(max(-1, min(1, sine))) / 1e-6, [(sequence, 15)]
            answer = (frame(0x240, (15e3 / 0.1, 24), (5e3 / 0.1, 24), (0, 1), *end)
                      + frame(0x241, (slope, 24), (0.01 / 1e-6, 24), (1, 1), *end)
                      + frame(0x243, (slope, 24), (0.01 / 1e-6, 24), (speed / 1e-5, 24), (0.05 / 1e-5, 24), (0, 1), (1, 1), *end))
            last = sequence
        print(answer, end="", flush=True)
