// What the pickle machine makes of the objects that a pickle describes.
#pragma once

#include <functional>
#include <string>
#include <string_view>
#include <unordered_map>
#include <vector>

#include "datasets/readers/arrays/pickle.h"
#include "datasets/readers/arrays/pickle_names.h"

namespace restage::pickle_detail {

/// Makes values of calls, and counts the memory that they take.
class Objects {
 public:
  using Id = ValueTree::Id;
  using Kind = ValueTree::Kind;
  Objects(ValueTree& tree, const PickleLimits& limits) : tree_(tree), limits_(limits) {}

  /// A name. InputError for one that is not known.
  Id global(const std::string& name);
  /// What the call of `function` with these arguments gives (REDUCE).
  Id call(Id function, Id arguments);
  /// An object of a class (NEWOBJ, INST, OBJ).
  Id make(Id type, Id arguments);
  /// Gives an object its state (BUILD). True if an array's bytes follow: take_array().
  bool build(Id object, Id state);
  /// The storage that a persistent id of torch names.
  Id storage(Id persistent);

  /// An array whose bytes lie in the pickle, behind its description (joblib). Returns how many
  /// bytes of `rest` it takes; of objects, `nested` reads the pickle there into a value.
  size_t take_array(Id object, std::string_view rest,
                    const std::function<size_t(std::string_view, Id&)>& nested);

  void charge(uint64_t bytes);  ///< InputError if too much memory would be taken
  [[noreturn]] void damaged(const std::string& what) const;
  [[noreturn]] void refuse(const std::string& name) const;

 private:
  /// What a value is that is none of the tree's kinds (there it is Kind::other).
  struct Special {
    enum class Of { name, type, array, wrapper, storage } of;
    Call call = Call::none;
    std::string name = "";            ///< a global name, or a type as numpy calls it
    std::string_view bytes = {};      ///< of a storage
    std::vector<int64_t> shape = {};  ///< of a wrapper
    uint64_t padding = 0;  ///< of a wrapper: its array is aligned, a length stands before
    bool fortran = false;
  };
  Id special(Special what);
  const Special* find(Id id, Special::Of of) const;
  const Special& need(Id id, Special::Of of, const char* what) const;

  Id argument(Id arguments, size_t i) const;
  int64_t whole(Id id) const;
  std::vector<int64_t> shape(Id id) const;
  const std::string& text(Id id) const;
  std::string encoded(Id text) const;

  Id list_of(Id arguments);
  Id path_text(Id arguments);
  Id tensor(Id arguments);
  Id array(const std::string& type, const std::vector<int64_t>& shape, bool fortran,
           std::string_view bytes);
  void build_array(Id object, Id state);
  void build_type(Id object, Id state);
  void build_wrapper(Id object, Id state);

  ValueTree& tree_;
  const PickleLimits& limits_;
  uint64_t used_ = 0;
  std::unordered_map<Id, Special> special_;
};

}  // namespace restage::pickle_detail
