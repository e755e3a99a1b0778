#include "autograd/cuda/indices.h"

#include <utility>

#include "autograd/cuda/kernels.h"

namespace restage::cuda {
namespace {

/// 1 where a kernel met an index outside; read and cleared by take_index_fault().
Tensor& index_flag(const Tensor& like) {
  static Tensor* flag = new Tensor;
  if (!flag->defined()) *flag = Tensor::zeros({1}, DType::i32, like.device());
  return *flag;
}
std::string& faulty_op() {
  static auto* op = new std::string;
  return *op;
}

}  // namespace

/// If several ops took an index since the host last waited, the error names the last of them.
void look_at(const Tensor& index, int64_t limit) {
  const int32_t* of = at<int32_t>(index);
  int32_t* flag = at<int32_t>(index_flag(index));
  faulty_op() = running_op();
  each(index.numel(), [=] RESTAGE_DEVICE(int64_t i) {
    if (of[i] < 0 || of[i] >= limit) *flag = 1;
  });
}

std::string take_index_fault() {
  const std::string op = std::exchange(faulty_op(), "");
  if (op.empty()) return "";  // also while the copy below waits
  Tensor& flag = index_flag(Tensor());
  if (flag.cpu().item() == 0) return "";
  flag = Tensor();  // the next flag is clear
  return op + " on the GPU: an index is outside";
}

/// A group for each target counts, then writes. Its threads look at parts of the index that follow
/// each other, so that places come in order.
Askers askers_of(const Tensor& index, int64_t targets) {
  const int64_t n = index.size(0), count = index.shape().product(1, index.rank()), all = targets;
  const auto room = [&](int64_t width) {
    return Tensor::empty({n, width}, DType::i32, index.device());
  };
  Askers out{count, targets, room(targets + 1), room(count)};
  const int32_t* of = at<int32_t>(index);
  int32_t *from = at<int32_t>(out.start), *to = at<int32_t>(out.place);
  groups(n * all, [=] RESTAGE_DEVICE(const Group& g, int64_t row) {
    const int64_t s = row / all, own = row % all;
    const double found =
        g.sum(count, [&](int64_t k) { return of[s * count + k] == own ? 1. : 0.; });
    g.each(1, [&](int64_t) { from[s * (all + 1) + own + 1] = static_cast<int32_t>(found); });
  });
  each(n, [=] RESTAGE_DEVICE(int64_t s) {
    from[s * (all + 1)] = 0;
    for (int64_t i = 1; i <= all; ++i) from[s * (all + 1) + i] += from[s * (all + 1) + i - 1];
  });
  groups(n * all, [=] RESTAGE_DEVICE(const Group& g, int64_t row) {
    const int64_t s = row / all, own = row % all, part = (count + kThreads - 1) / kThreads;
    const auto in_part = [&](int64_t t, auto f) {
      const int64_t end = count < (t + 1) * part ? count : (t + 1) * part;
      for (int64_t k = t * part; k < end; ++k)
        if (of[s * count + k] == own) f(k);
    };
    double* before = g.room;  // how many the threads before have found
    g.each(kThreads, [&](int64_t t) {
      before[t] = 0;
      in_part(t, [&](int64_t) { before[t] += 1; });
    });
    g.each(1, [&](int64_t) {
      double total = 0;
      for (int t = 0; t < kThreads; ++t) {
        const double own_count = before[t];
        before[t] = total;
        total += own_count;
      }
    });
    g.each(kThreads, [&](int64_t t) {
      int64_t next = s * count + from[s * (all + 1) + own] + static_cast<int64_t>(before[t]);
      in_part(t, [&](int64_t k) { to[next++] = static_cast<int32_t>(k); });
    });
  });
  return out;
}

}  // namespace restage::cuda
