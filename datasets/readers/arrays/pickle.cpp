#include "datasets/readers/arrays/pickle.h"

#include <cmath>
#include <cstring>
#include <unordered_map>

#include "autograd/base/format.h"
#include "datasets/readers/arrays/pickle_objects.h"
#include "datasets/readers/errors.h"
#include "datasets/readers/text/numbers.h"
#include "datasets/readers/text/text.h"

namespace restage {
namespace {

using Id = ValueTree::Id;
using Kind = ValueTree::Kind;

/// Bytes one after the other.
class Cursor {
 public:
  Cursor(std::string_view bytes, const pickle_detail::Objects& objects)
      : bytes_(bytes), objects_(objects) {}
  size_t at() const { return at_; }
  std::string_view rest() const { return bytes_.substr(at_); }
  bool is_at_end() const { return at_ == bytes_.size(); }

  std::string_view take(uint64_t n) {
    if (n > bytes_.size() - at_) objects_.damaged(cat("it ends after ", bytes_.size(), " bytes"));
    const std::string_view out = bytes_.substr(at_, n);
    at_ += n;
    return out;
  }
  unsigned char byte() { return static_cast<unsigned char>(take(1)[0]); }
  uint64_t number(size_t width) {
    const std::string_view raw = take(width);
    uint64_t out = 0;
    for (size_t i = 0; i < width; ++i)
      out |= uint64_t{static_cast<unsigned char>(raw[i])} << (8 * i);
    return out;
  }
  /// Without its end; that of Windows, too.
  std::string_view line() {
    const size_t end = bytes_.find('\n', at_);
    if (end == std::string_view::npos) objects_.damaged("a line has no end");
    std::string_view out = take(end - at_);
    take(1);
    if (out.ends_with('\r')) out.remove_suffix(1);
    return out;
  }

 private:
  std::string_view bytes_;
  size_t at_ = 0;
  const pickle_detail::Objects& objects_;
};

/// A whole number of any length in two's complement, as near as a double comes.
double little_endian(std::string_view raw) {
  double out = 0;
  for (size_t i = raw.size(); i-- > 0;) out = out * 256 + static_cast<unsigned char>(raw[i]);
  const bool negative = !raw.empty() && (static_cast<unsigned char>(raw.back()) & 0x80) != 0;
  return negative ? out - std::pow(256.0, static_cast<double>(raw.size())) : out;
}

int digit_of(char c) {
  return c >= '0' && c <= '9'   ? c - '0'
         : c >= 'a' && c <= 'f' ? c - 'a' + 10
         : c >= 'A' && c <= 'F' ? c - 'A' + 10
                                : -1;
}

void add_character(std::string& out, uint32_t code) {
  if (code < 0x80) {
    out += static_cast<char>(code);
  } else if (code < 0x800) {
    out += static_cast<char>(0xc0 | code >> 6);
    out += static_cast<char>(0x80 | (code & 63));
  } else {
    out += static_cast<char>(0xe0 | (code >> 12 & 15));
    out += static_cast<char>(0x80 | (code >> 6 & 63));
    out += static_cast<char>(0x80 | (code & 63));
  }
}

/// Text of protocol 0. `bytes`: 'a\x00' in quotes, whose escapes are bytes; else a\u00e9, whose
/// other characters are Latin-1.
std::string unescaped(std::string_view line, bool bytes) {
  if (bytes && line.size() >= 2 && (line[0] == '\'' || line[0] == '"'))
    line = line.substr(1, line.size() - 2);
  std::string out;
  for (size_t i = 0; i < line.size(); ++i) {
    const char kind = line[i] == '\\' && i + 1 < line.size() ? line[i + 1] : '\0';
    const size_t digits = kind == 'x' && bytes ? 2 : kind == 'u' && !bytes ? 4 : 0;
    uint32_t code = 0;
    bool whole = digits > 0 && i + 1 + digits < line.size();
    for (size_t k = 0; whole && k < digits; ++k) {
      const int digit = digit_of(line[i + 2 + k]);
      whole = digit >= 0;
      code = code * 16 + static_cast<uint32_t>(digit);
    }
    if (whole) {
      if (bytes)
        out += static_cast<char>(code);
      else
        add_character(out, code);
      i += 1 + digits;
    } else if (bytes && kind != '\0') {
      out += kind == 'n' ? '\n' : kind == 't' ? '\t' : kind == 'r' ? '\r' : kind;
      ++i;
    } else if (bytes) {
      out += line[i];
    } else {
      add_character(out, static_cast<unsigned char>(line[i]));
    }
  }
  return out;
}

/// The stack machine of one pickle.
class Machine {
 public:
  Machine(std::string_view bytes, pickle_detail::Objects& objects, ValueTree& tree, int depth)
      : objects_(objects), tree_(tree), in_(bytes, objects), depth_(depth) {}

  /// Its value; `taken` bytes.
  Id run(size_t& taken) {
    while (true) {
      const char code = in_.take(1)[0];
      if (code == '.') break;
      objects_.charge(kCharge);
      if (!plain(code) && !container(code) && !memo(code) && !object(code)) unknown(code);
    }
    taken = in_.at();
    return pop();
  }

 private:
  static constexpr uint64_t kCharge = 24;  // bytes that a step adds at most, but for texts

  // ---- the stack -------------------------------------------------------------------------------

  Id pop() {
    if (stack_.empty() || (!marks_.empty() && stack_.size() == marks_.back()))
      objects_.damaged("its stack is empty");
    const Id out = stack_.back();
    stack_.pop_back();
    return out;
  }
  Id& top() {
    if (stack_.empty()) objects_.damaged("its stack is empty");
    return stack_.back();
  }
  void push(Id id) { stack_.push_back(id); }
  /// What lies above the last mark.
  std::vector<Id> pop_marked() {
    if (marks_.empty()) objects_.damaged("a mark is missing");
    const auto begin = stack_.begin() + static_cast<std::ptrdiff_t>(marks_.back());
    std::vector<Id> out(begin, stack_.end());
    stack_.erase(begin, stack_.end());
    marks_.pop_back();
    objects_.charge(sizeof(Id) * out.size());
    return out;
  }
  void push_tuple(size_t n) {
    std::vector<Id> items(n);
    for (size_t i = n; i-- > 0;) items[i] = pop();
    push(tree_.add_list(std::move(items)));
    objects_.charge(sizeof(std::vector<Id>) + n * sizeof(Id));
  }
  void push_text(std::string_view text) {
    objects_.charge(sizeof(std::string) + text.size());
    push(tree_.add_text(std::string(text)));
  }

  // ---- numbers and text ------------------------------------------------------------------------

  double decimal(std::string_view line) {
    double out = 0;
    if (line.ends_with('L')) line.remove_suffix(1);
    if (!text::parse(line, out)) objects_.damaged("a number is none");
    return out;
  }

  bool plain(char code) {
    switch (code) {
      case 'N':
        return push(tree_.add_none()), true;
      case '\x88':
        return push(tree_.add_truth(true)), true;
      case '\x89':
        return push(tree_.add_truth(false)), true;
      case 'I': {
        const std::string_view line = in_.line();
        const bool truth = line == "00" || line == "01";
        push(truth ? tree_.add_truth(line == "01") : tree_.add_number(decimal(line)));
        return true;
      }
      case 'L':
      case 'F':
        return push(tree_.add_number(decimal(in_.line()))), true;
      case 'J':
        push(tree_.add_number(static_cast<int32_t>(static_cast<uint32_t>(in_.number(4)))));
        return true;
      case 'K':
        return push(tree_.add_number(static_cast<double>(in_.number(1)))), true;
      case 'M':
        return push(tree_.add_number(static_cast<double>(in_.number(2)))), true;
      case 'G':
        return push(tree_.add_number(number_at<double>(in_.take(8).data(), true))), true;
      case '\x8a':
        return push(tree_.add_number(little_endian(in_.take(in_.number(1))))), true;
      case '\x8b':
        return push(tree_.add_number(little_endian(in_.take(in_.number(4))))), true;
      case 'S':
        return push_text(unescaped(in_.line(), true)), true;
      case 'V':
        return push_text(unescaped(in_.line(), false)), true;
      case 'U':
      case 'C':
      case '\x8c':
        return push_text(in_.take(in_.number(1))), true;
      case 'T':
      case 'B':
      case 'X':
        return push_text(in_.take(in_.number(4))), true;
      case '\x8d':
      case '\x8e':
      case '\x96':
        return push_text(in_.take(in_.number(8))), true;
      default:
        return false;
    }
  }

  // ---- containers ------------------------------------------------------------------------------

  void extend(Id container, const std::vector<Id>& items) {
    const Kind kind = tree_.kind(container);
    if (kind != Kind::list && kind != Kind::map) objects_.damaged("it fills what is no container");
    if (kind == Kind::map && items.size() % 2 != 0) objects_.damaged("a key has no value");
    std::vector<Id>& all = tree_.grow(container);
    all.insert(all.end(), items.begin(), items.end());
    objects_.charge(sizeof(Id) * items.size());
  }

  bool container(char code) {
    switch (code) {
      case '(':
        return marks_.push_back(stack_.size()), true;
      case '1':
        return pop_marked(), true;
      case '0':
        if (!marks_.empty() && marks_.back() == stack_.size())
          marks_.pop_back();
        else
          pop();
        return true;
      case '2':
        return push(top()), true;
      case ']':
      case ')':
      case '\x8f':
        return push_tuple(0), true;
      case '}':
        return push(tree_.add_map()), true;
      case 'l':
      case 't':
      case '\x91':
        return push(tree_.add_list(pop_marked())), true;
      case 'd': {
        const std::vector<Id> items = pop_marked();
        push(tree_.add_map());
        return extend(top(), items), true;
      }
      case '\x85':
      case '\x86':
      case '\x87':
        return push_tuple(static_cast<size_t>(code - '\x84')), true;
      case 'a': {
        const Id item = pop();
        return extend_list(top(), {item}), true;
      }
      case 'e':
      case '\x90': {
        const std::vector<Id> items = pop_marked();
        return extend_list(top(), items), true;
      }
      case 's': {
        const Id value = pop(), key = pop();
        return extend_map(top(), {key, value}), true;
      }
      case 'u': {
        const std::vector<Id> items = pop_marked();
        return extend_map(top(), items), true;
      }
      default:
        return false;
    }
  }
  void extend_list(Id list, const std::vector<Id>& items) {
    if (!tree_.is(list, Kind::list)) objects_.damaged("it fills what is no list");
    extend(list, items);
  }
  void extend_map(Id map, const std::vector<Id>& items) {
    if (!tree_.is(map, Kind::map)) objects_.damaged("it fills what is no map");
    extend(map, items);
  }

  // ---- what was seen before --------------------------------------------------------------------

  Id remembered(uint64_t key) {
    const auto at = memo_.find(key);
    if (at == memo_.end()) objects_.damaged("it names a value that was not there");
    return at->second;
  }
  void remember(uint64_t key) {
    objects_.charge(64);
    memo_[key] = top();
  }

  uint64_t memo_number() {
    const double key = decimal(in_.line());
    if (!(key >= 0 && key < 1e15)) objects_.damaged("a number is none");
    return static_cast<uint64_t>(key);
  }

  bool memo(char code) {
    switch (code) {
      case 'p':
        return remember(memo_number()), true;
      case 'q':
        return remember(in_.number(1)), true;
      case 'r':
        return remember(in_.number(4)), true;
      case '\x94':
        return remember(memo_.size()), true;
      case 'g':
        return push(remembered(memo_number())), true;
      case 'h':
        return push(remembered(in_.number(1))), true;
      case 'j':
        return push(remembered(in_.number(4))), true;
      case '\x80':
        return in_.byte(), true;  // the protocol's number
      case '\x95':
        return in_.number(8), true;  // a frame's length
      default:
        return false;
    }
  }

  // ---- objects ---------------------------------------------------------------------------------

  const std::string& name_part(Id id) {
    if (!tree_.is(id, Kind::text)) objects_.damaged("a name is missing");
    return tree_.text(id);
  }

  bool object(char code) {
    switch (code) {
      case 'c': {
        const std::string_view module = in_.line(), name = in_.line();
        return push(objects_.global(cat(module, ".", name))), true;
      }
      case '\x93': {
        const Id name = pop(), module = pop();
        return push(objects_.global(name_part(module) + "." + name_part(name))), true;
      }
      case 'R': {
        const Id arguments = pop(), function = pop();
        return push(objects_.call(function, arguments)), true;
      }
      case '\x81': {
        const Id arguments = pop(), type = pop();
        return push(objects_.make(type, arguments)), true;
      }
      case '\x92': {
        pop();  // keywords
        const Id arguments = pop(), type = pop();
        return push(objects_.make(type, arguments)), true;
      }
      case 'i': {
        const std::string_view module = in_.line(), name = in_.line();
        const Id type = objects_.global(cat(module, ".", name));
        return push(objects_.make(type, tree_.add_list(pop_marked()))), true;
      }
      case 'o': {
        std::vector<Id> items = pop_marked();
        if (items.empty()) objects_.damaged("a class is missing");
        const Id type = items[0];
        items.erase(items.begin());
        return push(objects_.make(type, tree_.add_list(std::move(items)))), true;
      }
      case 'b':
        return build(), true;
      case 'Q':
        return push(objects_.storage(pop())), true;
      default:
        return false;
    }
  }

  void build() {
    const Id state = pop(), made = top();
    if (!objects_.build(made, state)) return;
    in_.take(objects_.take_array(made, in_.rest(), [&](std::string_view rest, Id& value) {
      constexpr int kDeepest = 20;  // pickles in pickles
      if (depth_ >= kDeepest) objects_.damaged("it nests too deep");
      size_t taken = 0;
      value = Machine(rest, objects_, tree_, depth_ + 1).run(taken);
      return taken;
    }));
  }

  [[noreturn]] void unknown(char code) {
    const auto number = static_cast<unsigned char>(code);
    if (code == 'P') objects_.refuse("a persistent id");
    if (number >= 0x82 && number <= 0x84) objects_.refuse("an extension of its own");
    if (number == 0x97 || number == 0x98) objects_.refuse("buffers that lie beside it");
    objects_.damaged(format("it has an operation 0x%02x", number));
  }

  pickle_detail::Objects& objects_;
  ValueTree& tree_;
  Cursor in_;
  int depth_;
  std::vector<Id> stack_;
  std::vector<size_t> marks_;
  std::unordered_map<uint64_t, Id> memo_;
};

}  // namespace

bool starts_as_pickle(std::string_view bytes) {
  return bytes.size() > 1 && bytes[0] == '\x80' && bytes[1] >= 2 && bytes[1] <= 5;
}

size_t read_pickle(std::string_view bytes, const PickleLimits& limits, ValueTree& tree) {
  pickle_detail::Objects objects(tree, limits);
  size_t taken = 0;
  tree.root = Machine(bytes, objects, tree, 0).run(taken);
  return taken;
}

}  // namespace restage
