// Something in a folder that several processes want and one makes, while the others wait for it.
#pragma once

#include <functional>
#include <optional>
#include <string>

#include "autograd/base/error.h"
#include "autograd/base/interrupt.h"
#include "train/lease.h"

namespace restage {

/// A file or folder that the making of NAME keeps beside it for later processes: `.NAME` +
/// `suffix`. (Drafts that nobody goes on from are named by name_beside().) By these names it is
/// known what a killed process has left.
std::string path_aside(const std::string& dir, const std::string& name, const char* suffix);

namespace made_once_detail {
void make_folder(const std::string& dir);
/// What processes that were killed have left of it.
bool has_leftovers(const std::string& dir, const std::string& name);
void remove_leftovers(const std::string& dir, const std::string& name);
/// Half a second; says whom it waits for unless that was told. Interrupted on a signal.
void wait(const std::string& dir, const std::string& name, bool told);
}  // namespace made_once_detail

/// `find` gives it if it is there and whole; `make` makes it so that it is found, and asks
/// lost() before it is published. Interrupted on a signal; WorkError if it cannot be read back.
template <class T>
T made_once(const std::string& dir, const std::string& name,
            const std::function<std::optional<T>()>& find,
            const std::function<void(const Lease& lease)>& make) {
  using namespace made_once_detail;
  make_folder(dir);
  const StopScope stop;
  for (bool told = false;; told = true) {
    auto there = find();
    if (there && !has_leftovers(dir, name)) return std::move(*there);
    auto lease = Lease::take(path_aside(dir, name, ".lease"), name);
    if (lease) {
      if (!there) there = find();  // somebody may just have finished
      if (!there) {
        make(*lease);
        there = find();  // what others read is what we use
      }
      if (!there)
        throw WorkError(dir + "/" + name +
                        " could not be read back; free some space and run it again");
      remove_leftovers(dir, name);
      lease->forget();
    }
    if (there) return std::move(*there);  // without the lease: somebody else tidies up
    wait(dir, name, told);
  }
}

}  // namespace restage
