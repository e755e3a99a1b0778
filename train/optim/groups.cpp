#include "train/optim/groups.h"

#include <fnmatch.h>

#include <algorithm>
#include <set>

#include "autograd/base/nearest.h"
#include "autograd/base/words.h"

namespace restage {
namespace {

constexpr size_t kLongestNames = 120;  // bytes of a message

/// Where a group matches nothing: the nearest names of parameters or of the modules above them, and
/// the first names if none is near.
[[noreturn]] void throw_unmatched(const std::string& pattern,
                                  const std::vector<NamedParameter>& parameters,
                                  const std::string& where) {
  if (parameters.empty())
    throw InputError(where, "is given for a model that has nothing to learn", "leave groups out");
  std::vector<std::string> known, all;
  std::set<std::string> seen;
  for (const NamedParameter& p : parameters) {
    known.push_back(p.name);
    for (size_t dot = p.name.find('.'); dot != std::string::npos; dot = p.name.find('.', dot + 1))
      if (seen.insert(p.name.substr(0, dot)).second) all.push_back(p.name.substr(0, dot) + ".*");
  }
  all.insert(all.end(), known.begin(), known.end());
  const std::string close = nearest(pattern, all);
  throw InputError(where, "matches no parameter of this stage by " + name_in_quotes(pattern),
                   close.empty() ? "the names are " + cut_list(known, kLongestNames)
                                 : "did you mean '" + close + "'?");
}

}  // namespace

std::vector<std::vector<NamedParameter>> grouped(const std::vector<NamedParameter>& parameters,
                                                 const std::vector<ParameterGroup>& groups,
                                                 const std::string& where) {
  std::vector<std::vector<NamedParameter>> out(groups.size() + 1);
  std::vector<bool> matched(groups.size(), false);
  for (const NamedParameter& p : parameters) {
    size_t taken = 0;
    for (size_t i = 0; i < groups.size(); ++i) {
      if (::fnmatch(groups[i].match.c_str(), p.name.c_str(), 0) != 0) continue;
      matched[i] = true;
      if (taken == 0) taken = i + 1;
    }
    out[taken].push_back(p);
  }
  for (size_t i = 0; i < groups.size(); ++i) {
    if (!matched[i]) throw_unmatched(groups[i].match, parameters, where);
    if (out[i + 1].empty())
      throw InputError(
          where,
          "has groups before " + name_in_quotes(groups[i].match) + " that take all that it matches",
          "put it before them: the first group that matches holds");
  }
  return out;
}

}  // namespace restage
