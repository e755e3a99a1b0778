#include "autograd/gradcheck/gradcheck.h"

#include <algorithm>
#include <cmath>

#include "autograd/base/format.h"
#include "autograd/base/parallel.h"
#include "autograd/gradcheck/evaluate.h"
#include "autograd/tensor/nan_memory.h"

namespace restage::gradcheck {
namespace {

constexpr double kRelative = 1e-6, kAbsolute = 1e-8;

std::string number(double v) { return format("%.12g", v); }

/// Collects failures under the name of one sample.
class Findings {
 public:
  Findings(const OpSamples& op, const Sample& sample)
      : prefix_(op.op + " " + sample.title + ": ") {}
  void fail(const std::string& what) { report.failures.push_back(prefix_ + what); }
  void require(bool ok, const std::string& what) {
    if (!ok) fail(what);
  }
  Report report;

 private:
  std::string prefix_;
};

/// sum of u * (plus - minus), element by element so that little cancels.
double dot_difference(const Tensor& u, const Tensor& plus, const Tensor& minus) {
  double total = 0;
  for (int64_t i = 0; i < u.numel(); ++i)
    total += u.data<double>()[i] * (plus.data<double>()[i] - minus.data<double>()[i]);
  return total;
}

double step_at(double x) { return std::cbrt(2.2e-16) * std::max(1.0, std::abs(x)); }

Tensor numeric_gradient(const Sample& s, size_t input, const Tensor& u) {
  std::vector<Tensor> inputs = s.inputs;
  inputs[input] = s.inputs[input].clone();
  double* x = inputs[input].data<double>();
  Tensor g = Tensor::zeros(inputs[input].shape(), DType::f64);
  for (int64_t i = 0; i < g.numel(); ++i) {
    const double before = x[i], h = step_at(before);
    x[i] = before + h;
    const double up = x[i];
    const Tensor plus = value_of(s, inputs).clone();
    x[i] = before - h;
    const double down = x[i];
    g.data<double>()[i] = dot_difference(u, plus, value_of(s, inputs)) / (up - down);
    x[i] = before;
  }
  return g;
}

double largest(const Tensor& t) {
  double top = 0;
  for (int64_t i = 0; i < t.numel(); ++i) top = std::max(top, std::abs(t.item(i)));
  return top;
}

void check_against_differences(const Sample& s, const Tensor& u, const Evaluation& e, Findings& f) {
  double top = 0;
  for (size_t k = 0; k < s.inputs.size(); ++k) {
    const Tensor numeric = numeric_gradient(s, k, u);
    const double scale = std::max(1.0, largest(numeric));
    top = std::max(top, largest(numeric));
    for (int64_t i = 0; i < numeric.numel(); ++i) {
      const double n = numeric.item(i), a = e.gradients[k].item(i);
      ++f.report.compared;
      if (std::abs(n - a) <= kRelative * std::max(std::abs(n), std::abs(a)) + kAbsolute * scale)
        continue;
      f.fail("gradient of input " + std::to_string(k) + " at " + std::to_string(i) + " is " +
             number(a) + ", finite differences say " + number(n));
      break;  // one line per input is enough
    }
  }
  if (f.report.compared > 0 && u.numel() > 0)
    f.require((top > 0) != s.zero_gradient, s.zero_gradient
                                                ? "the gradient is not zero, as the sample says"
                                                : "only zeros were compared with zeros");
}

/// One random direction through all inputs.
void check_direction(const Sample& s, const Tensor& u, const Evaluation& e, Findings& f) {
  constexpr double h = 1e-5;
  std::vector<Tensor> plus, minus;
  double analytic = 0, scale = 0;
  for (size_t k = 0; k < s.inputs.size(); ++k) {
    const Tensor v = random(s.inputs[k].shape(), 900 + k);
    plus.push_back(s.inputs[k].clone());
    minus.push_back(s.inputs[k].clone());
    for (int64_t i = 0; i < v.numel(); ++i) {
      plus[k].data<double>()[i] += h * v.item(i);
      minus[k].data<double>()[i] -= h * v.item(i);
      analytic += v.item(i) * e.gradients[k].item(i);
      scale += std::abs(v.item(i) * e.gradients[k].item(i));
    }
  }
  const double numeric = dot_difference(u, value_of(s, plus), value_of(s, minus)) / (2 * h);
  ++f.report.compared;
  f.require(scale > 0, "only zeros were compared with zeros");
  f.require(std::abs(numeric - analytic) <= kRelative * scale,
            "along a random direction the derivative is " + number(analytic) +
                ", finite differences say " + number(numeric));
}

/// Evaluates on memory full of NaN: what a kernel leaves unwritten is NaN in this result, and old
/// numbers in other evaluations.
Evaluation evaluate_over_nan(const Sample& s, const Tensor& u) {
  const NanMemory unwritten_shows;
  return evaluate(s, u);
}

void check_shapes(const Sample& s, const Evaluation& e, Findings& f) {
  f.require(e.value.dtype() == DType::f64, "the result is not float64");
  for (size_t k = 0; k < s.inputs.size(); ++k)
    f.require(e.gradients[k].shape() == s.inputs[k].shape() &&
                  e.gradients[k].dtype() == s.inputs[k].dtype(),
              "the gradient of input " + std::to_string(k) + " has another shape or dtype");
}

void check_bits(const Sample& s, const Tensor& u, const Evaluation& e, Findings& f) {
  const int before = threads();
  for (const int n : {1, 2, 3}) {
    set_threads(n);
    f.require(same_bits(e, evaluate(s, u)), "other bits with " + std::to_string(n) + " threads");
  }
  set_threads(before);
  f.require(same_bits(e, evaluate(s, u)), "other bits the next time (is every output written?)");
  const Var plain = built(s, s.inputs);
  f.require(!plain.on_tape(), "something was recorded without a tape");
  f.require(plain.value.device() == s.device, "the result lives on another device");
  f.require(same_bits(plain.value.cpu(), e.value), "without a tape the value differs");
}

void check_needs(const Sample& s, const Tensor& u, const Evaluation& e, Findings& f) {
  for (size_t k = 0; k < s.inputs.size(); ++k) {
    const Evaluation one = evaluate(s, u, [k](size_t i) { return i == k; });
    const std::string which = "with input " + std::to_string(k) + " alone on the tape ";
    f.require(same_bits(one.gradients[k], e.gradients[k]), which + "its gradient differs");
    for (size_t i = 0; i < s.inputs.size(); ++i)
      if (i != k) f.require(!one.gradients[i].defined(), which + "a constant received a gradient");
  }
}

void require_sum(const Tensor& got, const Tensor& a, const Tensor& b, const std::string& what,
                 Findings& f) {
  const double bound = 1e-12 * (1 + largest(a) + largest(b));
  if (!(got.shape() == a.shape())) return f.fail(what + ": the gradient has another shape");
  for (int64_t i = 0; i < got.numel(); ++i)
    if (!(std::abs(got.item(i) - a.item(i) - b.item(i)) <= bound))
      return f.fail(what + " receives " + number(got.item(i)) + " instead of " +
                    number(a.item(i) + b.item(i)));
}

/// Two calls with the same leaves, then pairs of inputs of one call bound to the same leaf.
void check_accumulation(const Sample& s, const Tensor& u, const Evaluation& e, Findings& f) {
  Sample doubled = s;
  doubled.build = [&s](Args x) {
    const Var first = s.build(x);
    return add(first, s.build(x));
  };
  const Evaluation both = evaluate(doubled, u);
  for (size_t k = 0; k < s.inputs.size(); ++k)
    require_sum(both.gradients[k], e.gradients[k], e.gradients[k],
                "input " + std::to_string(k) + ", used in two calls,", f);
  for (size_t a = 0; a < s.inputs.size(); ++a) {
    for (size_t b = a + 1; b < s.inputs.size(); ++b) {
      if (!(s.inputs[a].shape() == s.inputs[b].shape())) continue;
      Sample equal = s;  // separate leaves of equal value
      equal.inputs[b] = equal.inputs[a];
      const Evaluation apart = evaluate(equal, u);
      equal.build = [&s, a, b](Args x) {
        std::vector<Var> tied = x;
        tied[b] = tied[a];
        return s.build(tied);
      };
      require_sum(evaluate(equal, u).gradients[a], apart.gradients[a], apart.gradients[b],
                  "a value used as inputs " + std::to_string(a) + " and " + std::to_string(b), f);
    }
  }
}

void check_float32(const Sample& s, const Tensor& u, Findings& f) {
  Sample wide = s, narrow = s;  // the same numbers in both precisions
  for (size_t k = 0; k < s.inputs.size(); ++k) {
    narrow.inputs[k] = s.inputs[k].cast(DType::f32);
    wide.inputs[k] = narrow.inputs[k].cast(DType::f64);
  }
  const Tensor u32 = u.cast(DType::f32);
  const Evaluation d = evaluate(wide, u32.cast(DType::f64)), e = evaluate_over_nan(narrow, u32);
  const auto compare = [&](const Tensor& a, const Tensor& b, const std::string& what) {
    if (b.dtype() != DType::f32) return f.fail(what + " is not float32 for float32 inputs");
    const double bound = s.f32_tolerance * std::max(1.0, largest(a));
    for (int64_t i = 0; i < a.numel(); ++i)
      if (!(std::abs(a.item(i) - b.item(i)) <= bound))
        return f.fail(what + " in float32 is " + number(b.item(i)) + ", in float64 " +
                      number(a.item(i)));
  };
  compare(d.value, e.value, "the value");
  for (size_t k = 0; k < s.inputs.size(); ++k)
    compare(d.gradients[k], e.gradients[k], "the gradient of input " + std::to_string(k));
}

void check_smooth(const Sample& s, Findings& f) {
  std::vector<Tensor> before;
  for (const Tensor& t : s.inputs) before.push_back(t.clone());
  const Tensor u = random(value_of(s, s.inputs).shape(), 7);
  const Evaluation e = evaluate_over_nan(s, u);
  for (size_t k = 0; k < before.size(); ++k)
    f.require(same_bits(before[k], s.inputs[k]), "input " + std::to_string(k) + " was changed");
  check_shapes(s, e, f);
  if (!f.report.ok()) return;
  if (s.kind == Sample::Kind::smooth) {
    check_against_differences(s, u, e, f);
    check_needs(s, u, e, f);
    check_accumulation(s, u, e, f);
  } else {
    check_direction(s, u, e, f);
  }
  check_bits(s, u, e, f);
  check_float32(s, u, f);
}

void check_kink(const Sample& s, Findings& f) {
  const Tensor ones = Tensor::full(value_of(s, s.inputs).shape(), 1, DType::f64);
  const Evaluation e = evaluate_over_nan(s, ones);
  for (size_t k = 0; k < s.expected.size(); ++k) {
    if (!s.expected[k].defined()) continue;
    f.require(e.gradients[k].shape() == s.expected[k].shape(), "the gradient has another shape");
    if (!f.report.ok()) return;
    for (int64_t i = 0; i < s.expected[k].numel(); ++i, ++f.report.compared)
      f.require(std::abs(e.gradients[k].item(i) - s.expected[k].item(i)) <= 1e-12,
                "at the kink the gradient at " + std::to_string(i) + " is " +
                    number(e.gradients[k].item(i)) + ", documented is " +
                    number(s.expected[k].item(i)));
  }
}

/// Whether a mistake that only a kernel can see (in an index) is refused when the host waits for
/// the device.
bool refused_late(Device device, Findings& f) {
  try {
    backend(device).synchronise();
    return false;
  } catch (const Error& error) {
    const std::string what = error.what();
    f.require(what.find("in probe.layer") != std::string::npos,
              "the error does not say where: " + what);
    return true;
  }
}

void check_error(const OpSamples& op, const Sample& s, Findings& f) {
  Tape tape;
  std::vector<Var> leaves;
  for (size_t k = 0; k < s.inputs.size(); ++k)
    leaves.push_back(tape.leaf(s.inputs[k].to(s.device), k + 1));
  const size_t before = tape.size();
  std::string what;
  try {
    const ModuleScope outer("probe"), inner("layer");
    s.build(leaves);
    if (refused_late(s.device, f)) return;
    return f.fail("was not refused");
  } catch (const ShapeError& error) {
    what = error.what();
  } catch (const std::exception& error) {
    return f.fail(std::string("was refused, but not by a ShapeError: ") + error.what());
  }
  std::vector<std::string> needed = {op.op + " ", op.letters, "probe.layer"};
  for (const Tensor& t : s.inputs) needed.push_back(t.shape().str() + " " + name_of(t.dtype()));
  for (const std::string& part : needed)
    f.require(what.find(part) != std::string::npos,
              "the error does not name '" + part + "': " + what);
  f.require(tape.size() == before, "something was recorded before the error");
}

bool has_dimension(const Sample& s, int64_t size) {
  for (const Tensor& t : s.inputs)
    for (int i = 0; i < t.rank(); ++i)
      if (t.size(i) == size) return true;
  return false;
}

void check_complete(const OpSamples& op, Report& r) {
  const auto any = [&](auto&& fits) {
    return std::any_of(op.samples.begin(), op.samples.end(), fits);
  };
  using Kind = Sample::Kind;
  const auto need = [&](bool ok, const char* what) {
    if (!ok) r.failures.push_back(op.op + ": the samples lack " + what);
  };
  need(any([](const Sample& s) { return s.kind == Kind::smooth && has_dimension(s, 1); }),
       "a case with a dimension of 1");
  need(any([](const Sample& s) { return has_dimension(s, 0); }), "a case with a dimension of 0");
  need(any([](const Sample& s) { return s.kind == Kind::error; }), "a case that must be refused");
  need(any([](const Sample& s) { return s.kind == Kind::large; }), "a large case");
  need(op.random != nullptr, "a generator of random cases");
}

}  // namespace

std::string Report::text() const {
  std::string all;
  for (const std::string& line : failures) all += line + "\n";
  return all;
}

Report check_sample(const OpSamples& op, const Sample& sample) {
  Findings f(op, sample);
  try {
    switch (sample.kind) {
      case Sample::Kind::smooth:
      case Sample::Kind::large:
        check_smooth(sample, f);
        break;
      case Sample::Kind::kink:
        check_kink(sample, f);
        break;
      case Sample::Kind::error:
        check_error(op, sample, f);
        break;
    }
  } catch (const Error& error) {  // other exceptions are the caller's
    f.fail(std::string("unexpected error: ") + error.what());
  }
  return std::move(f.report);
}

Report check(const OpSamples& op, int random_cases, Device device) {
  Report all;
  const auto take = [&](Sample s) {
    s.device = device;
    const Report r = check_sample(op, s);
    all.failures.insert(all.failures.end(), r.failures.begin(), r.failures.end());
    all.compared += r.compared;
  };
  check_complete(op, all);
  for (const Sample& s : op.samples) take(s);
  for (int i = 0; op.random != nullptr && i < random_cases; ++i) {
    Rng rng(RngKey{7, 0}.fold(op.op).fold(static_cast<uint64_t>(i)));
    Sample s = op.random(rng);
    s.title = "random case " + std::to_string(i);
    for (const Tensor& t : s.inputs) s.title += " " + t.shape().str();
    take(s);
  }
  if (all.compared == 0) all.failures.push_back(op.op + ": nothing was compared");
  return all;
}

Tensor random(const Shape& shape, uint64_t stream, double gap) {
  Rng rng(RngKey{11, stream});
  Tensor t = Tensor::empty(shape, DType::f64);
  for (int64_t i = 0; i < t.numel(); ++i) {
    const double v = rng.normal();
    t.data<double>()[i] = v + (v < 0 ? -gap : gap);
  }
  return t;
}

}  // namespace restage::gradcheck
