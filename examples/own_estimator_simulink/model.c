/* Stand-in for what Embedded Coder generates: a Kalman filter of speed and grade with a step of 5 ms. */
#include "model.h"

#include <math.h>

#define STEP_S 0.005
#define G 9.81

ExtU_model_T model_U;
ExtY_model_T model_Y;

static struct {
  double v, theta, p00, p01, p11;
} model_DW;

void model_initialize(void) {
  model_U.accel = model_U.wheel_speed = 0.0;
  model_DW.v = model_DW.theta = model_DW.p01 = 0.0;
  model_DW.p00 = 0.01;
  model_DW.p11 = 0.03;
  model_Y.grade = 0.0;
  model_Y.grade_sd = sqrt(model_DW.p11);
}

void model_step(void) {
  double f = -STEP_S * G * cos(model_DW.theta), y, s, k0, k1;
  model_DW.v += STEP_S * (model_U.accel - G * sin(model_DW.theta));
  model_DW.p00 += 2.0 * f * model_DW.p01 + f * f * model_DW.p11 + 1e-4 * STEP_S;
  model_DW.p01 += f * model_DW.p11;
  model_DW.p11 += 4e-4 * STEP_S;
  y = model_U.wheel_speed - model_DW.v;
  s = model_DW.p00 + 4e-4;
  k0 = model_DW.p00 / s;
  k1 = model_DW.p01 / s;
  model_DW.v += k0 * y;
  model_DW.theta += k1 * y;
  model_DW.p11 -= k1 * model_DW.p01;
  model_DW.p01 *= 1.0 - k0;
  model_DW.p00 *= 1.0 - k0;
  model_Y.grade = model_DW.theta;
  model_Y.grade_sd = sqrt(fmax(model_DW.p11, 0.0));
}
