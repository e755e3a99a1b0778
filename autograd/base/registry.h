// What a name in a configuration, a file or a command line can mean: entries of ours, and those
// that a program which uses the library adds.
#pragma once

#include <deque>
#include <string>
#include <utility>
#include <vector>

#include "autograd/base/error.h"

namespace restage {

/// InputError: there is no `kind` of that name; it suggests the nearest of `names`, or all.
[[noreturn]] void throw_unknown(const std::string& kind, const std::string& name,
                                const std::vector<std::string>& names, const std::string& where);

/// Entries in the order in which they came. `key`: the member that holds an entry's name.
/// References to entries stay valid while others are added.
template <class T, std::string T::*key = &T::name>
class Registry {
 public:
  /// `kind`: what the entries are, for errors: "model".
  Registry(std::string kind, std::deque<T> ours)
      : kind_(std::move(kind)), entries_(std::move(ours)) {}

  const std::deque<T>& all() const { return entries_; }
  std::vector<std::string> names() const {
    std::vector<std::string> out;
    for (const T& entry : entries_) out.push_back(entry.*key);
    return out;
  }
  /// Error if there is one of that name.
  void add(T entry) {
    for (const T& known : entries_)
      if (known.*key == entry.*key)
        throw Error("the " + kind_ + " '" + entry.*key + "' has been registered already");
    entries_.push_back(std::move(entry));
  }
  /// Adds an entry, or puts it in the place of one of that name where may_go(that one); else Error.
  template <class MayGo>
  void put(T entry, const MayGo& may_go) {
    for (T& known : entries_)
      if (known.*key == entry.*key && may_go(known)) {
        known = std::move(entry);
        return;
      }
    add(std::move(entry));
  }
  /// The entry of that name. InputError if there is none; `where`: the file in which the name
  /// stands.
  const T& get(const std::string& name, const std::string& where = "") const {
    for (const T& entry : entries_)
      if (entry.*key == name) return entry;
    throw_unknown(kind_, name, names(), where);
  }

 private:
  std::string kind_;
  std::deque<T> entries_;
};

}  // namespace restage
