/* Stand-in for what Embedded Coder generates: put your model.h, model.c and what they include in its place. */
#ifndef MODEL_H
#define MODEL_H

/* Inports. */
typedef struct {
  double accel;       /* specific force along the train, m/s^2 */
  double wheel_speed; /* m/s */
} ExtU_model_T;

/* Outports. */
typedef struct {
  double grade;    /* rad */
  double grade_sd; /* rad */
} ExtY_model_T;

extern ExtU_model_T model_U;
extern ExtY_model_T model_Y;

void model_initialize(void);
/* One step of 5 ms. */
void model_step(void);

#endif
