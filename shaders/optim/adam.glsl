// One Adam step of one parameter (Kingma and Ba 2015, bias correction as in PyTorch), or, with UPDATE = 0, the
// gradient itself where the first moment would stand: the same code path gives tests their gradients.
// moment = (first, second); the result goes back into it.

const float ADAM_BETA1 = 0.9;
const float ADAM_BETA2 = 0.999;
const float ADAM_EPSILON = 1e-15;

float adam_step(float parameter, inout vec2 moment, float gradient, float rate) {
    if (UPDATE == 0) {
        moment = vec2(gradient, 0.0);
        return parameter;
    }
    moment.x = ADAM_BETA1 * moment.x + (1.0 - ADAM_BETA1) * gradient;
    moment.y = ADAM_BETA2 * moment.y + (1.0 - ADAM_BETA2) * gradient * gradient;
    return parameter -
           rate * moment.x / (sqrt(moment.y) * args.inverse_sqrt_correction2 + ADAM_EPSILON);
}

