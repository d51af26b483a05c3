#pragma once
// The page over HTTP: what is said to a browser that asks for one of its files. Needs no token, for
// it holds no data. Source: RFC 9110, section 13.1.2; W3C Content Security Policy 3.

#include <optional>
#include <string>

#include "daemon/service/transport/http_request.hpp"

namespace weft::daemon::server {

/// 200 or, by If-None-Match, 304; without the bytes for HEAD. Nothing: no file of the page.
std::optional<std::string> page_answer(const HttpRequest& request);

}  // namespace weft::daemon::server
