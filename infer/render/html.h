// Helpers of all our pages: text, data and templates in a form that may stand inside HTML.
#pragma once

#include <map>
#include <string>

namespace restage {

/// The text in a form that may stand in an element, or in an attribute in double quotes, of HTML
/// and of SVG.
std::string escape_html(const std::string& text);
/// JSON (ASCII) in a form that may stand inside a script element: no text in the document can end
/// the element.
std::string script_json(const std::string& json);
/// `page` with every `@NAME@` replaced by the value of NAME in `values`; a NAME without a
/// value stays. A text such as `@NAME@` inside a value is not replaced.
std::string fill_page(const std::string& page, const std::map<std::string, std::string>& values);

}  // namespace restage
