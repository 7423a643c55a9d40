"""An estimator behind CAN frames, in Python: the slope by accelerometer and wheels. Lines of candump in and out."""
import math
import sys

G, TAU = 9.81, 0.5                        # m/s²; time constant of the low-pass, s
speed = slow_speed = accel = slow_accel = 0.0
last, answer, seen = None, "", set()      # seen: the samples that came for this step


def frame(identifier: int, size: int, *raw: int) -> str:     # raw numbers of three bytes; the last one has the rest
    data = b"".join(number.to_bytes(3, "little", signed=number < 0) for number in raw[:-1])
    data += raw[-1].to_bytes(size - len(data), "little")
    return f"(0.0) can0 {identifier:03X}{'##0' if size > 8 else '#'}{data.hex().upper()}\n"


for line in sys.stdin:
    identifier, data = line.split()[2].replace("##0", "#").split("#")
    identifier, data = int(identifier, 16), bytes.fromhex(data)
    seen.add(identifier)
    if identifier == 0x100:               # specific_force: the axis along the train, behind a stamp of five bytes
        accel = int.from_bytes(data[5:8], "little", signed=True) * 1e-5
    elif identifier == 0x130:             # wheel_speed_drive_1
        speed = int.from_bytes(data[5:8], "little", signed=True) * 1e-5
    elif identifier == 0x220:             # step: all of it has come
        dt = int.from_bytes(data[5:8], "little") * 1e-6
        start, sequence = data[8] & 1, int.from_bytes(data[8:10], "little") >> 1
        if start:                         # what came before it is of another run
            accel, speed, last = accel * (0x100 in seen), speed * (0x130 in seen), None
            slow_speed, slow_accel = speed, accel
        if sequence != last:              # else the answer was lost: the same again
            slow_speed += (speed - slow_speed) * min(dt / TAU, 1)
            slow_accel += (accel - slow_accel) * min(dt / TAU, 1)
            sine = (slow_accel - (speed - slow_speed) / TAU) / G
            slope = round(math.asin(max(-1, min(1, sine))) * 1e6)
            answer = frame(0x240, 12, 150_000, 50_000, 0, sequence << 1)     # 15 t ± 5 t, no protection level, not valid
            answer += frame(0x241, 12, slope, 10_000, 0, sequence << 1 | 1)
            if last is None:              # the first step of this program: monorig is told, which finds a restart by it
                answer += frame(0x242, 12, 0, 0, 1 << 4 | sequence << 5)
            answer += frame(0x243, 20, slope, 10_000, round(speed * 1e5), 5_000, 0, sequence << 2 | 2)
        last, seen = sequence, set()
        print(answer, end="", flush=True)
