// Errors. A library function throws; only the command line (experiments/cli) prints and exits.
#pragma once

#include <memory>
#include <stdexcept>
#include <string>

#include "autograd/base/setting_names.h"

namespace restage {

/// Base of all errors of this project; `exit_code` is what the command line returns for it.
class Error : public std::runtime_error {
 public:
  explicit Error(const std::string& what, int code = 1)
      : std::runtime_error(what), exit_code(code) {}
  int exit_code;
};

/// The user's input or usage is at fault: exit code 2 and one line
/// `restage: <where>: <what is wrong>; <how to mend it>` (docs: command-line contract).
class InputError : public Error {
 public:
  /// `where` is a file or `file:line`, or empty when no file is involved. Settings in `cause` and
  /// `mend` are named as {fps} (setting_names.h).
  InputError(const std::string& where, const std::string& cause, const std::string& mend)
      : InputError(Parts{where, spelled(cause), spelled(mend)}) {}

  /// Of such a line, which another process printed: what stands behind the last "; " is the mend.
  static InputError of_line(const std::string& line) {
    const size_t end = line.rfind("; ");
    return end == std::string::npos ? InputError("", line, "mend it")
                                    : InputError("", line.substr(0, end), line.substr(end + 2));
  }

  const std::string& where() const { return parts_->where; }
  const std::string& cause() const { return parts_->cause; }
  const std::string& mend() const { return parts_->mend; }
  /// "<where>: <what is wrong>", without how to mend it.
  std::string complaint() const { return place_and(where(), cause()); }

 private:
  struct Parts {
    std::string where, cause, mend;
  };
  explicit InputError(const Parts& parts)
      : Error(place_and(parts.where, parts.cause) + "; " + parts.mend, 2),
        parts_(std::make_shared<const Parts>(parts)) {}
  static std::string place_and(const std::string& where, const std::string& cause) {
    return where.empty() ? cause : where + ": " + cause;
  }
  std::shared_ptr<const Parts> parts_;  // so that a copy cannot throw
};

/// The work itself failed (training diverged, disk full, verification found differences): code 1.
class WorkError : public Error {
 public:
  explicit WorkError(const std::string& what) : Error(spelled(what), 1) {}
};

/// Shapes or dtypes that do not fit an op. Names op, dimension letters, both shapes, module path.
class ShapeError : public Error {
 public:
  explicit ShapeError(const std::string& what) : Error(what, 1) {}
};

/// A value became infinite or NaN. Names op and module path.
class NonFiniteError : public Error {
 public:
  explicit NonFiniteError(const std::string& what) : Error(what, 1) {}
};

}  // namespace restage
