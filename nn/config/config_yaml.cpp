// YAML text to a ConfigNode tree. yaml-cpp's events are used instead of its nodes because the nodes
// forget duplicate keys and expand aliases without a bound.
#include <yaml-cpp/eventhandler.h>
#include <yaml-cpp/exceptions.h>
#include <yaml-cpp/mark.h>
#include <yaml-cpp/parser.h>

#include <map>
#include <sstream>
#include <string_view>
#include <utility>

#include "nn/config/config_tree.h"

namespace restage {
namespace {

/// yaml-cpp's messages may quote what it did not understand.
std::string printable(std::string text) {
  for (char& c : text)
    if (static_cast<unsigned char>(c) < 0x20 || c == 0x7f) c = '?';
  return text;
}

/// yaml-cpp lets any bytes pass, but JSON, which is written from them, must be UTF-8.
bool is_utf8(std::string_view text) {
  while (!text.empty()) {
    const auto lead = static_cast<unsigned char>(text[0]);
    const size_t n = lead < 0x80 ? 1 : lead < 0xe0 ? 2 : lead < 0xf0 ? 3 : 4;
    if ((lead >= 0x80 && lead < 0xc2) || lead > 0xf4 || text.size() < n) return false;
    uint32_t code = n == 1 ? lead : lead & (0xffU >> (n + 1));
    for (size_t i = 1; i < n; ++i) {
      const auto byte = static_cast<unsigned char>(text[i]);
      if ((byte & 0xc0) != 0x80) return false;
      code = code << 6 | (byte & 0x3f);
    }
    const bool longer = (n == 3 && code < 0x800) || (n == 4 && code < 0x10000);
    if (longer || (code >= 0xd800 && code < 0xe000) || code > 0x10ffff) return false;
    text.remove_prefix(n);
  }
  return true;
}

class TreeBuilder : public YAML::EventHandler {
 public:
  TreeBuilder(const std::string& source, bool lines) : source_(source), lines_(lines) {}

  ConfigNode root;
  bool started = false;

  void OnDocumentStart(const YAML::Mark& mark) override {
    if (started) fail(mark, "a second YAML document starts here", "keep one document in a file");
    started = true;
  }
  void OnDocumentEnd() override {}
  void OnNull(const YAML::Mark& mark, YAML::anchor_t anchor) override {
    add(mark, anchor, make(mark, ConfigNode::Kind::null));
  }
  void OnScalar(const YAML::Mark& mark, const std::string& tag, YAML::anchor_t anchor,
                const std::string& value) override {
    refuse_tag(mark, tag);
    if (!is_utf8(value)) fail(mark, "holds bytes that are no text in UTF-8", "save it as UTF-8");
    ConfigNode node = make(mark, ConfigNode::Kind::scalar);
    node.text = value;
    node.quoted = tag == "!";  // yaml-cpp's way of saying that the scalar stood in quotes
    add(mark, anchor, std::move(node));
  }
  void OnAlias(const YAML::Mark& mark, YAML::anchor_t anchor) override {
    const auto found = anchors_.find(anchor);
    if (found == anchors_.end())
      fail(mark, "an alias lies inside its own anchor", "remove the alias");
    count(mark, found->second.size());
    add(mark, 0, found->second);
  }
  void OnSequenceStart(const YAML::Mark& mark, const std::string& tag, YAML::anchor_t anchor,
                       YAML::EmitterStyle::value) override {
    open(mark, tag, anchor, ConfigNode::Kind::list);
  }
  void OnMapStart(const YAML::Mark& mark, const std::string& tag, YAML::anchor_t anchor,
                  YAML::EmitterStyle::value) override {
    open(mark, tag, anchor, ConfigNode::Kind::map);
  }
  void OnSequenceEnd() override { close(); }
  void OnMapEnd() override { close(); }

 private:
  /// A list or map that is still open; a map that has read a key waits for its value.
  struct Frame {
    ConfigNode node;
    YAML::anchor_t anchor = 0;
    bool has_key = false;
    std::string key;
    ConfigPlace key_place;
  };

  ConfigPlace place(const YAML::Mark& mark) const {
    return {source_, lines_ ? mark.line + 1 : 0, mark.column + 1};
  }
  [[noreturn]] void fail(const YAML::Mark& mark, const std::string& wrong,
                         const std::string& fix) const {
    throw InputError(place(mark).text(), wrong, fix);
  }
  ConfigNode make(const YAML::Mark& mark, ConfigNode::Kind kind) const {
    ConfigNode node;
    node.kind = kind;
    node.place = node.key_place = place(mark);
    return node;
  }
  void refuse_tag(const YAML::Mark& mark, const std::string& tag) const {
    if (!tag.empty() && tag != "?" && tag != "!")
      fail(mark, "the tag " + in_quotes(tag) + " is not supported", "remove it");
  }
  void count(const YAML::Mark& mark, size_t nodes) {
    nodes_ += nodes;
    if (nodes_ > kConfigMaxNodes)
      fail(mark, "more than " + std::to_string(kConfigMaxNodes) + " values, aliases expanded",
           "make the file smaller");
  }

  void open(const YAML::Mark& mark, const std::string& tag, YAML::anchor_t anchor,
            ConfigNode::Kind kind) {
    refuse_tag(mark, tag);
    if (stack_.size() >= static_cast<size_t>(kConfigMaxDepth))
      fail(mark, "nested deeper than " + std::to_string(kConfigMaxDepth), "flatten the file");
    need_key_first(mark);
    Frame frame;
    frame.node = make(mark, kind);
    frame.anchor = anchor;
    stack_.push_back(std::move(frame));
  }
  void close() {
    Frame frame = std::move(stack_.back());
    stack_.pop_back();
    finish(frame.anchor, std::move(frame.node));
  }
  /// A list or map cannot be the key of a map.
  void need_key_first(const YAML::Mark& mark) const {
    if (!stack_.empty() && stack_.back().node.kind == ConfigNode::Kind::map &&
        !stack_.back().has_key)
      fail(mark, "a bracket is open, or a list or section stands as a key", "write 'key: value'");
  }
  void add(const YAML::Mark& mark, YAML::anchor_t anchor, ConfigNode node) {
    count(mark, 1);
    const bool in_map = !stack_.empty() && stack_.back().node.kind == ConfigNode::Kind::map;
    if (in_map && !stack_.back().has_key) {
      if (node.kind != ConfigNode::Kind::scalar) need_key_first(mark);
      take_key(mark, std::move(node));
    } else {
      finish(anchor, std::move(node));
    }
  }
  void take_key(const YAML::Mark& mark, ConfigNode node) {
    Frame& map = stack_.back();
    if (node.text == "<<")
      fail(mark, "merge keys ('<<') are not supported", "use 'include: file.yaml'");
    if (map.node.children.size() >= kConfigMaxKeys)
      fail(mark, "more than " + std::to_string(kConfigMaxKeys) + " keys in one section",
           "give a configuration file");
    if (const ConfigNode* first = map.node.find(node.text))
      fail(mark,
           "the key " + in_quotes(node.text) + " stands here a second time (first in line " +
               std::to_string(first->key_place.line) + ")",
           "keep one of the two");
    map.has_key = true;
    map.key = std::move(node.text);
    map.key_place = place(mark);
  }
  /// Puts a value that is complete into its parent, and a copy of it under its anchor.
  void finish(YAML::anchor_t anchor, ConfigNode node) {
    if (anchor != 0) {
      nodes_ += node.size();
      anchors_[anchor] = node;
    }
    if (stack_.empty()) {
      root = std::move(node);
      return;
    }
    Frame& parent = stack_.back();
    if (parent.has_key) {
      node.key = std::move(parent.key);
      node.key_place = parent.key_place;
      // yaml-cpp places an absent value at the next token
      if (node.kind == ConfigNode::Kind::null) node.place = parent.key_place;
      parent.has_key = false;
    }
    parent.node.children.push_back(std::move(node));
  }

  std::string source_;
  bool lines_;  ///< false: the source is not a file
  std::vector<Frame> stack_;
  std::map<YAML::anchor_t, ConfigNode> anchors_;
  size_t nodes_ = 0;
};

}  // namespace

ConfigNode parse_yaml(std::string_view text, const std::string& source, bool any_root) {
  if (text.size() > kConfigMaxBytes)
    throw InputError(source, "is larger than 1 MiB", "give a configuration file");
  TreeBuilder builder(source, !any_root);
  try {
    std::istringstream stream{std::string(text)};
    YAML::Parser parser(stream);
    while (parser.HandleNextDocument(builder)) {
    }
  } catch (const YAML::Exception& error) {
    const int line = error.mark.is_null() ? 0 : error.mark.line + 1;
    throw InputError(ConfigPlace{source, any_root ? 0 : line, 0}.text(),
                     "is not YAML (" + printable(error.msg.substr(0, 80)) + ")",
                     "mend it here or just above");
  }
  ConfigNode root = std::move(builder.root);
  if (root.place.source.empty()) root.place = root.key_place = {source, any_root ? 0 : 1, 1};
  if (any_root) return root;
  if (root.kind == ConfigNode::Kind::null) root.kind = ConfigNode::Kind::map;  // an empty file
  if (root.kind != ConfigNode::Kind::map)
    throw InputError(root.place.text(), "holds no 'key: value' lines", "give a configuration file");
  return root;
}

}  // namespace restage
