#include "autograd/base/registry.h"

#include "autograd/base/nearest.h"
#include "autograd/base/words.h"

namespace restage {

void throw_unknown(const std::string& kind, const std::string& name,
                   const std::vector<std::string>& names, const std::string& where) {
  constexpr size_t kLongest = 150;  // an error is one line of less than 400 characters
  const std::string near = nearest(name, names);
  throw InputError(
      where, "there is no " + kind + " '" + name + "'",
      near.empty() ? "use one of " + cut_list(names, kLongest) : "did you mean '" + near + "'?");
}

}  // namespace restage
