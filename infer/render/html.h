// What our pages share: text, data and templates made safe to stand inside HTML.
#pragma once

#include <cstddef>
#include <map>
#include <nlohmann/json_fwd.hpp>
#include <string>

namespace restage {

std::string base64(const void* data, size_t size);
/// For the text of an element, or an attribute in double quotes, of HTML and of SVG.
std::string escape_html(const std::string& text);
/// JSON that may stand inside a script element: nothing in it ends the element. Bytes that are no
/// UTF-8 are replaced.
std::string script_json(const nlohmann::ordered_json& json);
/// `page` with every @NAME@ that `values` has replaced; in one pass, so that nothing in a value is
/// taken for a name.
std::string fill_page(const std::string& page, const std::map<std::string, std::string>& values);

}  // namespace restage
