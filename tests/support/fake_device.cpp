#include "tests/support/fake_device.h"

#include <sys/mman.h>

#include <bit>
#include <cstring>
#include <map>
#include <mutex>
#include <optional>
#include <set>
#include <string>
#include <vector>

#include "autograd/base/error.h"
#include "autograd/base/module_path.h"
#include "autograd/kernels/attention.h"
#include "autograd/kernels/layout.h"
#include "autograd/tensor/host_view.h"

namespace restage {
namespace {

constexpr size_t kRange = size_t{16} << 30, kAlign = 64;  // reserved; what is not used costs nothing

std::byte* reserve(int rights) {
  void* range = ::mmap(nullptr, kRange, rights, MAP_PRIVATE | MAP_ANONYMOUS | MAP_NORESERVE, -1, 0);
  if (range == MAP_FAILED) throw Error("the fake device finds no room for its addresses");
  return static_cast<std::byte*>(range);
}

/// What is wrong with the index of a kernel that takes one; ops cannot look at it here.
std::optional<std::string> index_fault(std::type_index args_type, const void* args) {
  const auto outside = [](const Tensor& index, int64_t limit) {
    return index_within(index, limit) ? std::nullopt
                                      : std::optional<std::string>("an index is outside");
  };
  if (args_type == typeid(GatherArgs)) {
    const auto& a = *static_cast<const GatherArgs*>(args);
    return outside(a.index, a.x.size(1));
  }
  if (args_type == typeid(ScatterAddArgs)) {
    const auto& a = *static_cast<const ScatterAddArgs*>(args);
    return outside(a.index, a.out.size(1));
  }
  if (args_type == typeid(NeighbourAttentionArgs)) {
    const auto& a = *static_cast<const NeighbourAttentionArgs*>(args);
    return outside(a.in.index, a.in.xyz.size(1));
  }
  return std::nullopt;
}

class FakeBackend final : public Backend {
 public:
  FakeBackend() : addresses_(reserve(PROT_NONE)), numbers_(reserve(PROT_READ | PROT_WRITE)) {}
  void enter() { device_ = add_device(*this); }
  Device device() const { return device_; }

  std::string_view name() const override { return "fake"; }

  void* allocate(size_t bytes) override {
    const std::lock_guard lock(mutex_);
    const size_t size = std::bit_ceil(std::max(bytes, kAlign));
    std::vector<std::byte*>& spare = free_[size];
    std::byte* data = nullptr;
    if (!spare.empty()) {
      data = spare.back();
      spare.pop_back();
    } else {
      if (kRange - used_ < size) throw std::bad_alloc();
      data = addresses_ + used_;
      used_ += size;
    }
    std::memset(there(data), 0xff, bytes);
    return data;
  }
  void release(void* data, size_t bytes) override {
    const std::lock_guard lock(mutex_);
    free_[std::bit_ceil(std::max(bytes, kAlign))].push_back(static_cast<std::byte*>(data));
  }
  void fill_zero(void* data, size_t bytes) override { std::memset(there(data), 0, bytes); }
  void copy_in(void* to, const void* from, size_t bytes) override {
    std::memcpy(there(to), from, bytes);
  }
  void copy(void* to, const void* from, size_t bytes) override {
    std::memcpy(there(to), there(from), bytes);
  }
  void copy_out(void* to, const void* from, size_t bytes) override {
    synchronise();
    std::memcpy(to, there(from), bytes);
  }
  void synchronise() override {
    ++counts.waits;
    if (const auto fault = std::exchange(fault_, std::nullopt)) throw Error(*fault);
  }

  bool supports(std::type_index args) const override {
    return !lacking.contains(args) && backend(Device{}).supports(args);
  }
  void run(std::type_index args_type, const void* args) override {
    if (lacking.contains(args_type))
      throw Error(std::string("no kernel for ") + args_type.name() + " on fake");
    ++counts.kernels;
    const HostView view(device_, numbers_ - addresses_);
    if (const auto fault = index_fault(args_type, args))
      fault_ = running_op() + " on device 'fake': " + *fault;
    else
      backend(Device{}).run(args_type, args);
  }

  std::set<std::type_index> lacking;
  FakeCounts counts;

 private:
  void* there(void* data) const { return static_cast<std::byte*>(data) + (numbers_ - addresses_); }
  const void* there(const void* data) const {
    return static_cast<const std::byte*>(data) + (numbers_ - addresses_);
  }

  Device device_;
  std::byte *addresses_, *numbers_;
  size_t used_ = 0;
  std::mutex mutex_;
  std::map<size_t, std::vector<std::byte*>> free_;
  std::optional<std::string> fault_;  // of a kernel, told to whoever waits
};

FakeBackend& fake() {
  static FakeBackend* instance = [] {
    auto* made = new FakeBackend;  // never destroyed, like the CPU's
    made->enter();
    return made;
  }();
  return *instance;
}

}  // namespace

Device fake_device() { return fake().device(); }

WithoutKernels::WithoutKernels(std::initializer_list<std::type_index> contracts) {
  fake().lacking = contracts;
}
WithoutKernels::~WithoutKernels() { fake().lacking.clear(); }

FakeCounts fake_counts() { return fake().counts; }

}  // namespace restage
