#include "infer/render/html.h"

namespace restage {

std::string escape_html(const std::string& text) {
  std::string out;
  for (const char c : text) {
    if (c == '&')
      out += "&amp;";
    else if (c == '<')
      out += "&lt;";
    else if (c == '>')
      out += "&gt;";
    else if (c == '"')
      out += "&quot;";
    else
      out += c;
  }
  return out;
}

std::string script_json(const std::string& json) {
  std::string out;
  for (const char c : json)
    if (c == '<')
      out += "\\u003c";
    else
      out += c;
  return out;
}

std::string fill_page(const std::string& page, const std::map<std::string, std::string>& values) {
  std::string out;
  size_t at = 0;
  while (at < page.size()) {
    const size_t open = page.find('@', at);
    const size_t close = open == std::string::npos ? open : page.find('@', open + 1);
    const auto value = close == std::string::npos
                           ? values.end()
                           : values.find(page.substr(open + 1, close - open - 1));
    if (value == values.end()) {
      const size_t end = open == std::string::npos ? page.size() : open + 1;
      out.append(page, at, end - at);
      at = end;
    } else {
      out.append(page, at, open - at);
      out += value->second;
      at = close + 1;
    }
  }
  return out;
}

}  // namespace restage
