#include "autograd/cpu/amx.h"

#include "autograd/base/error.h"
#include "autograd/kernels/matmul_precision.h"

#if defined(__x86_64__) && defined(__linux__)
#define RESTAGE_AMX 1
#include <cpuid.h>
#include <immintrin.h>
#include <sys/syscall.h>
#include <unistd.h>
#endif

namespace restage {
namespace {

#ifdef RESTAGE_AMX

/// CPUID says what the processor has; the system has to let a process use the 8 KiB of tiles.
bool find_matrix_unit() {
  unsigned a = 0, b = 0, c = 0, d = 0;
  constexpr unsigned bf16 = 1u << 22, tiles = 1u << 24;
  if (!__get_cpuid_count(7, 0, &a, &b, &c, &d) || (d & bf16) == 0 || (d & tiles) == 0) return false;
  constexpr long request_permission = 0x1023, tile_data = 18;  // ARCH_REQ_XCOMP_PERM, XTILEDATA
  return ::syscall(SYS_arch_prctl, request_permission, tile_data) == 0;
}

#else
bool find_matrix_unit() { return false; }
#endif

bool& in_use() {
  static bool use = has_matrix_unit();
  return use;
}

}  // namespace

bool has_matrix_unit() {
  static const bool found = find_matrix_unit();
  return found;
}

bool matrix_unit() { return in_use(); }

void use_matrix_unit(bool use) {
  if (use && !has_matrix_unit()) throw Error("this processor has no matrix unit for bfloat16");
  in_use() = use;
}

namespace cpu {

#ifdef RESTAGE_AMX

namespace {

/// The operand of LDTILECFG: palette 1, eight tiles of 16 rows of 64 bytes.
struct alignas(64) TileConfig {
  uint8_t palette = 1, start_row = 0, reserved[14] = {};
  uint16_t row_bytes[16] = {64, 64, 64, 64, 64, 64, 64, 64};
  uint8_t rows[16] = {16, 16, 16, 16, 16, 16, 16, 16};
};
static_assert(sizeof(TileConfig) == 64);
const TileConfig config;

__attribute__((target("amx-tile"))) void configure_tiles() { _tile_loadconfig(&config); }
__attribute__((target("amx-tile"))) void release_tiles() { _tile_release(); }

}  // namespace

AmxScope::AmxScope(bool use) : use_(use) {
  if (use_) configure_tiles();
}

AmxScope::~AmxScope() {
  if (use_) release_tiles();
}

__attribute__((target("amx-tile,amx-bf16"))) void amx_multiply(int64_t steps, const uint32_t* a,
                                                               const uint32_t* b, bool add,
                                                               float* sums) {
  constexpr int row = 64, line = 2 * row;  // bytes of a packed row and of a row of sums
  float *right = sums + 16, *lower = sums + 16 * 32, *last = lower + 16;
  if (add) {
    _tile_loadd(0, sums, line);
    _tile_loadd(1, right, line);
    _tile_loadd(2, lower, line);
    _tile_loadd(3, last, line);
  } else {
    _tile_zero(0);
    _tile_zero(1);
    _tile_zero(2);
    _tile_zero(3);
  }
  for (; steps > 0; --steps, a += 512, b += 512) {
    _tile_loadd(4, a, row);
    _tile_loadd(5, a + 256, row);
    _tile_loadd(6, b, row);
    _tile_loadd(7, b + 256, row);
    _tile_dpbf16ps(0, 4, 6);
    _tile_dpbf16ps(1, 4, 7);
    _tile_dpbf16ps(2, 5, 6);
    _tile_dpbf16ps(3, 5, 7);
  }
  _tile_stored(0, sums, line);
  _tile_stored(1, right, line);
  _tile_stored(2, lower, line);
  _tile_stored(3, last, line);
}

#else

AmxScope::AmxScope(bool) : use_(false) {}
AmxScope::~AmxScope() = default;
void amx_multiply(int64_t, const uint32_t*, const uint32_t*, bool, float*) {}

#endif

}  // namespace cpu
}  // namespace restage
