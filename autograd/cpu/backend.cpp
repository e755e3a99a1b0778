#include <cstring>

#include "autograd/cpu/kernels.h"
#include "autograd/cpu/pool.h"

namespace restage {
namespace {

class CpuBackend final : public Backend {
 public:
  CpuBackend() {
#define RESTAGE_ENTER(kernel, Args) add<Args, cpu::kernel>();
    RESTAGE_KERNELS(RESTAGE_ENTER)
#undef RESTAGE_ENTER
  }
  std::string_view name() const override { return "cpu"; }
  void* allocate(size_t bytes) override { return cpu::pool_allocate(bytes); }
  void release(void* data, size_t bytes) override { cpu::pool_release(data, bytes); }
  void fill_zero(void* data, size_t bytes) override {
    if (bytes > 0) std::memset(data, 0, bytes);
  }
  void copy_in(void* to, const void* from, size_t bytes) override { copy(to, from, bytes); }
  void copy(void* to, const void* from, size_t bytes) override { std::memcpy(to, from, bytes); }
  void copy_out(void* to, const void* from, size_t bytes) override { copy(to, from, bytes); }
  void synchronise() override {}
  MemoryStats memory() const override { return cpu::pool_stats(); }
  void reset_peak() override { cpu::pool_reset_peak(); }
  void trim() override { cpu::pool_trim(); }
};

}  // namespace

Backend& cpu_backend() {
  static CpuBackend* instance = new CpuBackend;  // never destroyed, like the pool
  return *instance;
}

}  // namespace restage
