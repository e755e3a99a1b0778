// Names of files that were downloaded or copied several times: which of them are frames.
#pragma once

#include <optional>
#include <string>
#include <vector>

namespace restage::numbered {

/// The first of a series whose names have numbers but for this one: "scan", "scan (1)", as browsers
/// number downloads; "scan", "scan 2"; "scan", "scan_1"; "scan", "scan.001", as Blender does.
struct Unnumbered {
  std::string first;
  std::string as_number;  ///< the name that `first` would have
};

/// The name among these that is the first of such a series: the numbers behind it begin with 1 or 2
/// (in brackets with any), without zeros in front. Of several the last by name.
std::optional<Unnumbered> unnumbered_first(const std::vector<std::string>& stems);

/// The name of which this one says to be a copy ("scan - Copy", "scan - Copy (2)", "scan copy 2",
/// "Copy of scan" and the same in some other languages); nothing if it does not.
std::optional<std::string> copied_name(const std::string& stem);

}  // namespace restage::numbered
