// A page in the desktop's browser.
#pragma once

#include <string>

namespace restage::cli {

/// InputError: there is no display to show a page on.
void check_display();
/// Where the page of a file lies, which a browser may look at when we are gone: in the user's
/// cache, from which pages of days before are removed.
std::string page_for(const std::string& file);
/// Opens the page by the desktop's own program. That may be the browser itself, which goes on when
/// we are gone: it has a session of its own, and only its failure is waited for.
void open_page(const std::string& page);

}  // namespace restage::cli
