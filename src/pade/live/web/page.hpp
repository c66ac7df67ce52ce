// The files of the page, as they are in src/pade/live/web/page, and view_3d.js of src/pade/report/view_3d.
#pragma once

#include <string_view>

namespace pade::live {

std::string_view page_html();
std::string_view page_script();
std::string_view page_view_3d();

}  // namespace pade::live
