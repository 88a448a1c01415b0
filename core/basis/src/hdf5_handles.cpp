#include "hdf5_handles.h"

#include <string_view>

namespace gonio::basis::detail {
namespace {

herr_t keep_innermost(unsigned, const H5E_error2_t* error, void* message) {
  auto& text = *static_cast<std::string*>(message);
  if (text.empty() && error->desc != nullptr) text = error->desc;
  return 0;
}

}  // namespace

SilentH5Errors::SilentH5Errors() {
  H5Eget_auto2(H5E_DEFAULT, &function_, &data_);
  H5Eset_auto2(H5E_DEFAULT, nullptr, nullptr);
}

SilentH5Errors::~SilentH5Errors() { H5Eset_auto2(H5E_DEFAULT, function_, data_); }

std::string last_h5_message() {
  std::string message;
  H5Ewalk2(H5E_DEFAULT, H5E_WALK_UPWARD, keep_innermost, &message);
  // A failed system call comes with time, addresses and sizes; people need the system's words.
  constexpr std::string_view kSystemWords = "error message = '";
  const std::size_t begin = message.find(kSystemWords);
  if (begin == std::string::npos) return message;
  message.erase(0, begin + kSystemWords.size());
  return message.substr(0, message.find('\''));
}

H5Handle fixed_text_type(std::size_t size) {
  H5Handle type(H5Tcopy(H5T_C_S1), H5Tclose);
  H5Tset_size(type.get(), size);
  H5Tset_cset(type.get(), H5T_CSET_UTF8);
  H5Tset_strpad(type.get(), H5T_STR_NULLPAD);
  return type;
}

}  // namespace gonio::basis::detail
