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

/// Places are sorted by what they name, and targets then look for where theirs begin.
Askers askers_of(const Tensor& index, int64_t targets) {
  const int64_t n = index.size(0), count = index.numel(), m = n > 0 ? count / n : 0,
                all = n * targets;
  const auto room = [&](int64_t size) { return Tensor::empty({size}, DType::i32, index.device()); };
  Tensor keys = room(count);
  Askers out{room(all + 1), room(count)};
  const int32_t* of = at<int32_t>(index);
  int32_t *key = at<int32_t>(keys), *place = at<int32_t>(out.place);
  each(count, [=] RESTAGE_DEVICE(int64_t k) {
    const bool inside = of[k] >= 0 && of[k] < targets;
    key[k] = static_cast<int32_t>(inside ? k / m * targets + of[k] : all);
    place[k] = static_cast<int32_t>(k);
  });
  sort_by_key(keys, out.place, all + 1);
  key = at<int32_t>(keys);
  int32_t* start = at<int32_t>(out.start);
  each(all + 1, [=] RESTAGE_DEVICE(int64_t target) {
    int64_t low = 0, high = count;  // the first key that is not below the target
    while (low < high) {
      const int64_t middle = (low + high) / 2;
      if (key[middle] < target)
        low = middle + 1;
      else
        high = middle;
    }
    start[target] = static_cast<int32_t>(low);
  });
  return out;
}

}  // namespace restage::cuda
