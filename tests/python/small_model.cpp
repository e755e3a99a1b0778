// The model that tests/python/test_engine.py writes and trains in Python, written in C++: both must
// give the same bits. Argument: a file of its numbers at the start. Prints the loss of each step.
#include <cstdio>
#include <memory>
#include <string>
#include <vector>

#include "autograd/ops/elementwise.h"
#include "autograd/ops/linear.h"
#include "autograd/ops/reduce.h"
#include "nn/weights/safetensors.h"
#include "train/optim/adam.h"

namespace {

using namespace restage;

int train(const std::string& path, int steps) {
  const TensorFile start = read_safetensors(path);
  const auto at = [&](const std::string& name) { return start.tensors.at(name).clone(); };
  const Tensor x = at("x"), target = at("target");
  std::vector<std::unique_ptr<Parameter>> parameters;
  std::vector<NamedParameter> named;
  for (const char* name : {"w0", "b0", "w1", "b1", "w2", "b2"}) {
    parameters.push_back(std::make_unique<Parameter>(at(name)));
    named.push_back({name, parameters.back().get()});
  }
  Adam adam(named, {});
  for (int i = 0; i < steps; ++i) {
    Tape tape;
    const auto bind = [&](size_t k) { return tape.leaf(parameters[k]->value, parameters[k]->id); };
    Var h = x;
    for (size_t k = 0; k < 3; ++k)
      h = linear(h, bind(2 * k), bind(2 * k + 1), k < 2 ? Activation::relu : Activation::none);
    const Var loss = mse(h, target);
    adam.step(tape.backward(loss), 1e-2, 1);
    std::printf("%.17g\n", loss.value.item());
  }
  return 0;
}

}  // namespace

int main(int argc, char** argv) {
  if (argc != 2) return 2;
  return train(argv[1], 60);
}
