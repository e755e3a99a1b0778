#include "tests/support/fake_device.h"

#include <optional>
#include <set>
#include <string>
#include <utility>

#include "autograd/base/error.h"
#include "autograd/base/module_path.h"
#include "autograd/kernels/attention.h"
#include "autograd/kernels/layout.h"

namespace restage {
namespace {

/// Whether the index of a kernel that takes one is outside; ops cannot look at it here.
bool index_outside(std::type_index args_type, const void* args) {
  if (args_type == typeid(GatherArgs)) {
    const auto& a = *static_cast<const GatherArgs*>(args);
    return !index_within(a.index, a.x.size(1));
  }
  if (args_type == typeid(ScatterAddArgs)) {
    const auto& a = *static_cast<const ScatterAddArgs*>(args);
    return !index_within(a.index, a.out.size(1));
  }
  if (args_type == typeid(NeighbourAttentionArgs)) {
    const auto& a = *static_cast<const NeighbourAttentionArgs*>(args);
    return !index_within(a.in.index, a.in.xyz.size(1));
  }
  return false;
}

class FakeBackend final : public GuardedBackend {
 public:
  FakeBackend() : GuardedBackend("fake") {}
  std::set<std::type_index> lacking;

 private:
  void run_kernel(std::type_index args_type, const void* args) override {
    if (lacking.contains(args_type))
      throw Error(std::string("no kernel for ") + args_type.name() + " on fake");
    if (index_outside(args_type, args))
      fault_ = running_op() + " on device 'fake': an index is outside";
    else
      backend(Device{}).run(args_type, args);
  }
  std::string take_fault() override { return std::exchange(fault_, ""); }

  std::string fault_;
};

FakeBackend& fake() {
  static FakeBackend* instance = new FakeBackend;  // never destroyed, like the CPU's
  return *instance;
}

}  // namespace

Device fake_device() { return fake().device(); }
DeviceCounts fake_counts() { return fake().counts; }

WithoutKernels::WithoutKernels(std::initializer_list<std::type_index> contracts) {
  fake().lacking = contracts;
}
WithoutKernels::~WithoutKernels() { fake().lacking.clear(); }

}  // namespace restage
