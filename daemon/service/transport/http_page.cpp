#include "daemon/service/transport/http_page.hpp"

#include "daemon/service/transport/http_answer.hpp"
#include "daemon/service/transport/http_file.hpp"
#include "daemon/service/web/web_files.hpp"

namespace weft::daemon::server {
namespace {

// Scripts, styles and answers come from here and nowhere else; nothing that is written into the
// page runs; no other page has it in a frame.
constexpr std::string_view guards =
    "Content-Security-Policy: default-src 'none'; script-src 'self'; style-src 'self'; "
    "img-src 'self'; connect-src 'self'; base-uri 'none'; form-action 'none'; "
    "frame-ancestors 'none'\r\n"
    "X-Content-Type-Options: nosniff\r\n"
    "Referrer-Policy: no-referrer\r\n"
    "Cross-Origin-Opener-Policy: same-origin\r\n"
    "Cross-Origin-Resource-Policy: same-origin\r\n";

}  // namespace

std::optional<std::string> page_answer(const HttpRequest& request) {
  const web::WebFile* const file = web::find_web_file(request.path());
  if (file == nullptr) return std::nullopt;
  const std::string tag = "\"" + std::string(file->sha256) + "\"";
  const bool known = names_tag(request.header("If-None-Match"), tag);
  std::string out = status_line(known ? 304 : 200);
  out += "ETag: " + tag + "\r\n";
  if (!known)
    out += "Content-Type: " + std::string(file->type) +
           "\r\nContent-Length: " + std::to_string(file->bytes.size()) + "\r\n";
  out += guards;
  out += "Cache-Control: no-cache\r\nConnection: close\r\n\r\n";
  if (!known && request.method() == "GET") out += file->bytes;
  return out;
}

}  // namespace weft::daemon::server
