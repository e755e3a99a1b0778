// The gradient harness: one set of checks that every op passes in float64. Public, so that users
// who write ops can hold them to the same rules. An op comes with an OpSamples: a few inputs by
// hand, inputs at kinks, inputs that must be refused, and a generator of random ones.
//
//   OpSamples swish = samples_for<Swish>();
//   swish.add("[2, 3]", {random({2, 3}, 1)}, [](Args x) { return call(Swish{}, {x[0]}); });
//   Report r = check(swish);   // r.failures says what is wrong, r.compared how much was compared
#pragma once

#include <deque>
#include <functional>
#include <string>
#include <utility>
#include <vector>

#include "autograd/base/rng.h"
#include "autograd/tape/tape.h"

namespace restage::gradcheck {

using Args = const std::vector<Var>&;
using Build = std::function<Var(Args)>;

struct Sample {
  enum class Kind {
    smooth,  ///< differentiable around the inputs: all checks
    large,   ///< enough numbers to be shared by threads: derivative along one random direction
    kink,    ///< backward of the sum of the result must equal `expected`, the documented choice
    error    ///< build must throw a ShapeError and record nothing
  };
  std::string title;           ///< for messages
  std::vector<Tensor> inputs;  ///< float64 (errors: anything)
  Build build;                 ///< must be a pure function of its arguments
  Kind kind = Kind::smooth;
  /// Of kinks: a gradient for each input; an undefined one is not compared.
  std::vector<Tensor> expected = {};
  bool zero_gradient = false;   ///< the true gradient of every input is zero here
  double f32_tolerance = 1e-4;  ///< float32 gradients, relative to the largest float64 one
  /// Where the sample is computed; inputs and results are in the host's memory.
  Device device = {};
};

/// All samples of one op.
struct OpSamples {
  std::string op;       ///< the op's name
  std::string letters;  ///< its dimension letters, which every ShapeError must repeat
  std::vector<Sample> samples = {};
  /// A random valid case: shapes and values are functions of the generator. Null: none.
  std::function<Sample(Rng&)> random = nullptr;

  /// Each adds one sample and returns it, so that its other members can be set.
  Sample& add(const std::string& title, std::vector<Tensor> inputs, Build build,
              Sample::Kind kind = Sample::Kind::smooth) {
    return samples.emplace_back(Sample{title, std::move(inputs), std::move(build), kind});
  }
  Sample& large(const std::string& title, std::vector<Tensor> inputs, Build build) {
    return add(title, std::move(inputs), std::move(build), Sample::Kind::large);
  }
  Sample& error(const std::string& title, std::vector<Tensor> inputs, Build build) {
    return add(title, std::move(inputs), std::move(build), Sample::Kind::error);
  }
  void kink(const std::string& title, std::vector<Tensor> inputs, Build build,
            std::vector<Tensor> expected) {
    add(title, std::move(inputs), std::move(build), Sample::Kind::kink).expected =
        std::move(expected);
  }
};

template <class Op>
OpSamples samples_for() {
  return {Op::name, Op::letters};
}

/// The result of the checks.
struct Report {
  std::vector<std::string> failures;  ///< empty: passed
  int64_t compared = 0;               ///< derivatives compared with finite differences
  bool ok() const { return failures.empty(); }
  std::string text() const;  ///< the failures, one a line
};

/// Checks of one sample. Smooth ones:
/// - gradient: backward against central differences (step cbrt(eps) * max(1, |x|)) under a random
///   cotangent; |numeric - analytic| <= 1e-6 * max(|numeric|, |analytic|) + 1e-8 * scale, where
///   scale is the largest derivative of the input or 1;
/// - not vacuous: something was compared, and not only zeros with zeros;
/// - no input is written to;
/// - each input alone on the tape gives the same bits as all together (needs), and the others none;
/// - a value used twice, in two calls and as two inputs of one call, receives the sum;
/// - the same bits again, for 1, 2 and 3 threads and over memory full of NaN (nothing is left
///   unwritten); without a tape the same value and no record;
/// - float32 agrees within f32_tolerance.
Report check_sample(const OpSamples& op, const Sample& sample);

/// All samples and `random_cases` random ones, computed on a device, and that the table is
/// complete: a sample with a dimension of 1, one with 0 (or an error that refuses it), an error and
/// a generator.
Report check(const OpSamples& op, int random_cases = 12, Device device = {});

/// Samples of every op of autograd/ops and of the functions composed of them (conv1d, mse, ...),
/// and of those that were registered. Those that are there stay where they are when more come.
const std::deque<OpSamples>& all_samples();
/// Adds the samples of an op of a program that uses this library, before all_samples() is asked
/// for. Using an op needs no registration (call(), autograd/tape/tape.h). Error if an op of that
/// name has samples already.
void register_op(OpSamples samples);

/// Standard normal float64 numbers; `stream` picks others. Away from zero by at least `gap`.
Tensor random(const Shape& shape, uint64_t stream, double gap = 0);

}  // namespace restage::gradcheck
