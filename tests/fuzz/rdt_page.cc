// The HTTP side of a Net F/T box: its pages, requests for them, and a reply split anywhere.

#include <string>
#include <string_view>

#include "protocols/rdt/page.hpp"
#include "tests/fuzz/chunked.hpp"

namespace weft::fuzz::rdt_page_target {
namespace {

using namespace protocols::rdt;

/// A reply with the interface that split() needs: at most one page, and nothing after a refusal.
struct ReplySplitter {
  HttpReply reply;
  bool refused = false, given = false;

  void push(ByteView bytes) {
    if (!refused && !given) refused = !reply.push(bytes).has_value();
  }
  bool next(std::string& page) {
    if (refused || given || !reply.complete()) return false;
    page = reply.body();
    return given = true;
  }
};

/// A tag as text cannot be written back: the pages have no escapes.
bool plain(std::string_view text) {
  return text.find('<') == std::string_view::npos;
}

void try_settings(std::string_view xml) {
  const Result<SettingsPage> page = decode_settings(xml);
  if (!page) return demand(!page.error().what.empty(), "an error says what is wrong");
  demand(page->counts_per_force > 0 && page->counts_per_torque > 0, "counts are above zero");
  if (!plain(page->product) || !plain(page->force_unit) || !plain(page->torque_unit)) return;
  SettingsPage written = *page;
  written.rdt_rate_hz = 0;  // it is written as a whole number
  const Result<SettingsPage> again = decode_settings(encode(written));
  demand(again && again->product == page->product && again->force_unit == page->force_unit &&
             again->torque_unit == page->torque_unit &&
             again->counts_per_force == page->counts_per_force &&
             again->counts_per_torque == page->counts_per_torque &&
             again->rdt_enabled == page->rdt_enabled,
         "settings that were read are written back");
}

void try_calibration(std::string_view xml) {
  const Result<CalibrationPage> page = decode_calibration(xml);
  if (!page) return demand(!page.error().what.empty(), "an error says what is wrong");
  if (!plain(page->serial)) return;
  const Result<CalibrationPage> again = decode_calibration(encode(*page));
  demand(again && again->serial == page->serial &&
             again->counts_per_force == page->counts_per_force &&
             again->counts_per_torque == page->counts_per_torque,
         "a calibration that was read is written back");
}

void try_request(std::string_view head) {
  const Result<HttpRequest> request = decode_request_head(head);
  if (!request) return demand(!request.error().what.empty(), "an error says what is wrong");
  const std::string target =
      request->query.empty() ? request->path : request->path + "?" + request->query;
  const Result<HttpRequest> again = decode_request_head(http_get(target, "box"));
  demand(again && again->path == request->path && again->query == request->query,
         "a request that was read is written back");
  if (const auto value = query_value(request->query, "comrdtrate"))
    demand(value->find('&') == std::string_view::npos, "a value ends where the next key begins");
}

void try_reply(const ChunkedInput& input) {
  const ByteView stream = input.stream.first(std::min(input.stream.size(), largest_page));
  ReplySplitter whole, pieces;
  const auto at_once = split<std::string>(whole, stream, {});
  demand(at_once == split<std::string>(pieces, stream, input.sizes),
         "any chunking gives the same page");
  demand(whole.refused == pieces.refused, "any chunking is refused alike");
  for (const std::string& page : at_once) {
    try_settings(page);
    try_calibration(page);
  }
}

}  // namespace

WEFT_FUZZ_TARGET(rdt_page) {
  const ChunkedInput input({data, size});
  const std::string_view text(reinterpret_cast<const char*>(input.stream.data()),
                              input.stream.size());
  try_settings(text);
  try_calibration(text);
  try_request(text);
  try_reply(input);
  return 0;
}

}  // namespace weft::fuzz::rdt_page_target
