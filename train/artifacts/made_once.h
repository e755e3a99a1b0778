// Something in a folder that several processes want and one makes, while the others wait for it.
#pragma once

#include <functional>
#include <optional>
#include <string>

#include "autograd/base/atomic_file.h"
#include "autograd/base/error.h"
#include "autograd/base/interrupt.h"
#include "train/lease.h"

namespace restage {

/// A file or folder that the making of NAME keeps beside it for later processes: `.NAME` +
/// `suffix`. (Drafts that nobody goes on from are named by name_beside().) By these names it is
/// known what a killed process has left.
std::string path_aside(const std::string& dir, const std::string& name, const char* suffix);

namespace made_once_detail {
/// Whether there are leftovers of processes that were killed while they made `name`.
bool has_leftovers(const std::string& dir, const std::string& name);
void remove_leftovers(const std::string& dir, const std::string& name);
/// Waits half a second; logs whom it waits for unless `told`. Interrupted on a signal.
void wait(const std::string& dir, const std::string& name, bool told);
}  // namespace made_once_detail

/// Returns what `find` gives if it is there and whole. Otherwise one process calls `make`, after
/// which `find` must give it; `make` asks lost() of its lease before it publishes. Interrupted on a
/// signal; WorkError if what was made cannot be read back.
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
        there = find();  // this process, too, uses what others will read
      }
      if (!there)
        throw WorkError(dir + "/" + name +
                        " could not be read back; free some space and run it again");
      remove_leftovers(dir, name);
      lease->forget();
    }
    if (there) return std::move(*there);  // this process has no lease: another one tidies up
    wait(dir, name, told);
  }
}

}  // namespace restage
