#include "drivers/ati_netft/page_reader.hpp"

namespace weft::drivers {

using namespace protocols::rdt;

Status PageReader::read(Link& link) {
  link_ = &link;
  at_calibration_ = false;
  link.on_receive([this](ByteView bytes, TimePoint) { received(bytes); });
  link.on_closed([this](const Error& why) { finish(pass(why, "the settings page")); });
  return send_request(settings_path);
}

void PageReader::let_go() {
  if (link_ == nullptr) return;
  link_->on_receive({});
  link_->on_closed({});
  link_ = nullptr;
}

Status PageReader::send_request(std::string_view path) {
  reply_.clear();
  const std::string request = http_get(path, "netft");
  return link_->write({reinterpret_cast<const std::uint8_t*>(request.data()), request.size()});
}

void PageReader::received(ByteView bytes) {
  if (Status fine = reply_.push(bytes); !fine) return finish(pass(fine.error()));
  if (!reply_.complete()) return;
  if (at_calibration_) {
    auto page = decode_calibration(reply_.body());
    if (!page) return finish(pass(page.error(), calibration_path));
    pages_.calibration = std::move(*page);
    return finish(pages_);
  }
  auto page = decode_settings(reply_.body());
  if (!page) return finish(pass(page.error(), settings_path));
  pages_.settings = std::move(*page);
  at_calibration_ = true;
  if (Status sent = send_request(calibration_path); !sent) finish(pass(sent.error()));
}

void PageReader::finish(Result<BoxPages> outcome) {
  let_go();
  done_(std::move(outcome));
}

}  // namespace weft::drivers
