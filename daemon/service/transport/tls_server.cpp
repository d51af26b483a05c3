#include "daemon/service/transport/tls_server.hpp"

#include <sys/stat.h>

#include <asio/ssl.hpp>

namespace weft::daemon::server {
namespace {

Status readable(const std::filesystem::path& file, const char* what) {
  std::error_code none;
  if (std::filesystem::is_regular_file(file, none)) return {};
  return fail({.code = Errc::not_found,
               .where = file.string(),
               .what = std::string("no ") + what + " there",
               .expected = "a PEM file"});
}

Status check_private(const std::filesystem::path& key) {
  struct stat found {};
  if (stat(key.c_str(), &found) != 0 || (found.st_mode & 07) == 0) return {};
  return fail({.code = Errc::wrong_state,
               .where = key.string(),
               .what = "everybody may read the key",
               .expected = "a file that is the daemon's and its group's",
               .hint = "chmod 640 " + key.string()});
}

tl::unexpected<Error> unusable(const char* what, const std::filesystem::path& file,
                               const asio::error_code& error) {
  return fail({.code = Errc::parse,
               .where = file.string(),
               .what = std::string("unusable ") + what,
               .expected = "PEM",
               .got = error.message()});
}

}  // namespace

TlsServer::TlsServer(std::unique_ptr<asio::ssl::context> context) : context_(std::move(context)) {}
TlsServer::~TlsServer() = default;

Result<std::unique_ptr<TlsServer>> TlsServer::load(const std::filesystem::path& certificate,
                                                   const std::filesystem::path& key) {
  if (Status ok = readable(certificate, "certificate"); !ok) return pass(ok.error());
  if (Status ok = readable(key, "key"); !ok) return pass(ok.error());
  if (Status ok = check_private(key); !ok) return pass(ok.error());
  auto context = std::make_unique<asio::ssl::context>(asio::ssl::context::tls_server);
  SSL_CTX_set_min_proto_version(context->native_handle(), TLS1_2_VERSION);
  // No renegotiation: a client could have us work for it again and again.
  SSL_CTX_set_options(context->native_handle(), SSL_OP_NO_RENEGOTIATION | SSL_OP_NO_COMPRESSION);
  asio::error_code error;
  context->use_certificate_chain_file(certificate.string(), error);
  if (error) return unusable("certificate", certificate, error);
  context->use_private_key_file(key.string(), asio::ssl::context::pem, error);
  if (error) return unusable("key", key, error);
  if (SSL_CTX_check_private_key(context->native_handle()) != 1)
    return fail(
        {.code = Errc::parse, .where = key.string(), .what = "the key is not the certificate's"});
  return std::unique_ptr<TlsServer>(new TlsServer(std::move(context)));
}

}  // namespace weft::daemon::server
