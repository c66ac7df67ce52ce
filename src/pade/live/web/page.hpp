// The files of the page, as they are in src/pade/live/web/page.
#pragma once

#include <string_view>

namespace pade::live {

std::string_view page_html();
std::string_view page_script();

}  // namespace pade::live
