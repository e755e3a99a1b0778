// What another project does with the installed library: a value, a tape, a gradient, its comparison
// with finite differences. The inspection of a file that is not there makes the linker pull in
// HDF5, and exceptions cross the library's edge.
#include <cstdio>
#include <vector>

#include "autograd/base/error.h"
#include "autograd/gradcheck/gradcheck.h"
#include "autograd/ops/reduce.h"
#include "datasets/schema.h"
#include "own_network.h"

int main() {
  using namespace restage;
  Tape tape;
  const Var x = tape.leaf(Tensor::from<double>({3}, {1, 2, 3}), 1);
  const Gradients gradients = tape.backward(sum_all(square(x)));
  const Tensor* gradient = gradients.find(1);
  if (gradient == nullptr) return 1;
  std::printf("d/dx sum(x^2) = %g %g %g\n", gradient->item(0), gradient->item(1),
              gradient->item(2));
  gradcheck::OpSamples samples{"x^2", ""};
  const gradcheck::Report report = gradcheck::check_sample(
      samples,
      {"two numbers", {gradcheck::random({2}, 1)}, [](gradcheck::Args x) { return square(x[0]); }});
  if (!report.ok() || report.compared == 0) return 1;
  if (!mine::checks_an_op() || !mine::finds_joints() || !mine::trains_and_answers()) return 1;
  try {
    inspect("no such file.h5");
  } catch (const InputError&) {
    return 0;
  }
  return 1;
}
