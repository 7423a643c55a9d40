/* An estimator behind CAN frames, in C: the slope by accelerometer and wheels. Datagrams of cannelloni by UDP.
 * cc -O2 -o ecu ecu.c -lm && ./ecu 47800 */
#include <arpa/inet.h>
#include <math.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

static const double G = 9.81, TAU = 0.5; /* m/s²; time constant of the low-pass, s */
static double speed, slow_speed, accel, slow_accel;
static uint8_t answer[128];
static size_t length;
static int last = -1, seen; /* the last step; the samples that came for this one: 1, 2 */

static uint64_t raw(const uint8_t *data, int bytes) { return bytes ? data[0] | raw(data + 1, bytes - 1) << 8 : 0; }
static double number(const uint8_t *data) { return ((int32_t)(raw(data, 3) << 8) >> 8) * 1e-5; }
static void put(uint64_t value, int bytes) {
  for (; bytes > 0; bytes--, value >>= 8) answer[length++] = (uint8_t)value;
}
static void head(uint32_t id, uint8_t bytes) { /* of a frame: identifier, length; behind that of CAN FD its flags */
  put(id << 24 | (id & 0xFF00) << 8, 4), put(bytes > 8 ? bytes | 0x80 : bytes, bytes > 8 ? 2 : 1);
}

static void step(double dt, int start, int sequence) {
  if (start) /* what came before it is of another run */
    last = -1, slow_accel = accel = seen & 1 ? accel : 0.0, slow_speed = speed = seen & 2 ? speed : 0.0;
  seen = 0;
  if (sequence == last) return; /* the answer was lost: the same again */
  int began = last < 0;         /* the first step of this program: monorig is told, which finds a restart by it */
  slow_speed += (speed - slow_speed) * fmin(dt / TAU, 1.0);
  slow_accel += (accel - slow_accel) * fmin(dt / TAU, 1.0);
  double sine = (slow_accel - (speed - slow_speed) / TAU) / G;
  uint64_t slope = (uint64_t)lround(asin(fmax(-1.0, fmin(1.0, sine))) * 1e6), n = (uint64_t)(last = sequence);
  memcpy(answer, (uint8_t[]){2, 0, (uint8_t)sequence, 0, (uint8_t)(3 + began)}, length = 5);
  head(0x240, 12), put(150000, 3), put(50000, 3), put(0, 3), put(n << 1, 3); /* 15 t ± 5 t, no protection level, not valid */
  head(0x241, 12), put(slope, 3), put(10000, 3), put(0, 3), put(n << 1 | 1, 3);
  if (began) head(0x242, 12), put(0, 6), put(1 << 4 | n << 5, 6);
  head(0x243, 20), put(slope, 3), put(10000, 3), put((uint64_t)lround(speed * 1e5), 3), put(5000, 3), put(0, 3);
  put(n << 2 | 2, 5); /* the speed alone is valid */
}

int main(int count, char **words) {
  struct sockaddr_in own = {.sin_family = AF_INET, .sin_addr = {htonl(INADDR_LOOPBACK)}}, rig;
  own.sin_port = htons((uint16_t)atoi(count > 1 ? words[1] : "47800"));
  int bus = socket(AF_INET, SOCK_DGRAM, 0);
  if (bind(bus, (struct sockaddr *)&own, sizeof own)) return perror("bind"), 1;
  for (;;) {
    uint8_t in[65536 + 128];
    socklen_t size = sizeof rig;
    ssize_t bytes = recvfrom(bus, in, 65536, 0, (struct sockaddr *)&rig, &size), at = 5; /* behind the header */
    for (const uint8_t *data; at + 5 <= bytes; at = data - in + (in[at + 4] & 0x7F)) {
      data = in + at + (in[at + 4] & 0x80 ? 6 : 5);
      int id = in[at + 2] << 8 | in[at + 3];
      if (id == 0x100) accel = number(data + 5), seen |= 1; /* specific_force: the axis along the train */
      if (id == 0x130) speed = number(data + 5), seen |= 2; /* wheel_speed_drive_1 */
      if (id != 0x220) continue;                            /* step: all of it has come */
      step(raw(data + 5, 3) * 1e-6, data[8] & 1, (int)(raw(data + 8, 2) >> 1));
      sendto(bus, answer, length, 0, (struct sockaddr *)&rig, size);
    }
  }
}
