#include "drivers/ati_netft/page_reader.hpp"

namespace weft::drivers {

using namespace protocols::rdt;

Status PageReader::read(Link& link) {
  link_ = &link;
  at_calibration_ = false;
  pages_ = {};
  link.on_receive([this](ByteView bytes, TimePoint) {
    try {
      received(bytes);
    } catch (const std::exception& error) {  // as DriverBase::guard, which does not see this link
      fail_with({.code = Errc::parse, .what = "page not readable", .got = error.what()});
    }
  });
  link.on_closed([this](const Error& why) { fail_with(why); });
  return send_request(settings_path);
}

void PageReader::let_go() {
  if (link_ == nullptr) return;
  link_->on_receive({});
  link_->on_closed({});
  link_ = nullptr;
}

bool PageReader::go_without_calibration() {
  if (!at_calibration_) return false;
  fail_with({.code = Errc::timeout, .what = "no page from the box", .got = "nothing received"});
  return true;
}

Status PageReader::send_request(std::string_view path) {
  reply_.clear();
  const std::string request = http_get(path, "netft");
  return link_->write({reinterpret_cast<const std::uint8_t*>(request.data()), request.size()});
}

void PageReader::received(ByteView bytes) {
  if (Status fine = reply_.push(bytes); !fine) return fail_with(fine.error());
  if (!reply_.complete()) return;
  if (at_calibration_) return on_calibration();
  on_settings();
}

void PageReader::on_settings() {
  auto page = decode_settings(reply_.body());
  if (!page) return fail_with(page.error());
  pages_.settings = std::move(*page);
  at_calibration_ = true;
  // A box closes its connection after each page. The link opens a new one to write.
  link_->on_closed([this](const Error& why) { fail_with(why); });
  if (Status sent = send_request(calibration_path); !sent) fail_with(sent.error());
}

void PageReader::on_calibration() {
  auto page = decode_calibration(reply_.body());
  if (!page) return fail_with(page.error());
  pages_.calibration = std::move(*page);
  finish(pages_);
}

void PageReader::fail_with(const Error& why) {
  if (!at_calibration_) return finish(pass(why, settings_path));
  pages_.missing = Error(why).in(calibration_path);
  finish(pages_);
}

void PageReader::finish(Result<BoxPages> outcome) {
  let_go();
  done_(std::move(outcome));
}

}  // namespace weft::drivers
