// oracle_runner CASE.safetensors ANSWER.safetensors: answers a case of the oracle with the
// project's own tape, ops and models, so that anyone can check them against numbers they have never
// seen.
#include <cstdio>

#include "autograd/base/error.h"
#include "tests/oracle/oracle_case.h"

int main(int argc, char** argv) {
  if (argc != 3) {
    std::fprintf(stderr, "usage: oracle_runner CASE.safetensors ANSWER.safetensors\n");
    return 2;
  }
  try {
    const std::string where = argv[1];
    restage::write_safetensors(argv[2],
                               restage::oracle::answer(restage::read_safetensors(where), where));
    return 0;
  } catch (const restage::Error& e) {
    std::fprintf(stderr, "oracle_runner: %s\n", e.what());
    return e.exit_code;
  } catch (const std::exception& e) {
    std::fprintf(stderr, "oracle_runner: %s\n", e.what());
    return 1;
  }
}
