#include "autograd/base/host.h"

#include <sys/random.h>
#include <unistd.h>

#include "autograd/base/error.h"
#include "autograd/base/format.h"

namespace restage {

std::string host_name() {
  char name[256] = "";
  return ::gethostname(name, sizeof name - 1) == 0 && name[0] != '\0' ? name : "unknown";
}

std::string unique_token() {
  unsigned long long bits = 0;
  if (::getrandom(&bits, sizeof bits, 0) != static_cast<ssize_t>(sizeof bits))
    throw WorkError("no random numbers from the system");
  return format("%016llx", bits);
}

}  // namespace restage
