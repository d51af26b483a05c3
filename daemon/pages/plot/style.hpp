#pragma once
// The style of pages and pictures, for light and dark screens and for paper.

#include <string>
#include <string_view>

namespace weft::daemon {

/// For every page. Its rules apply in a shadow root as well as in a page.
std::string style_sheet();

/// A picture as a separate file, with its style and background.
std::string standalone_svg(std::string_view svg);

}  // namespace weft::daemon
