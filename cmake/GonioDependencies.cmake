# Third-party libraries, all from Debian 12 packages (the list is in ./dev). Nothing is downloaded.
#
#   Eigen3::Eigen  gonio::openblas  hdf5::hdf5  SQLite::SQLite3  TIFF::TIFF  PNG::PNG
#   tomlplusplus::tomlplusplus  nlohmann_json::nlohmann_json  CLI11::CLI11  fmt::fmt
#   OpenSSL::Crypto  Threads::Threads  GTest::gtest  GTest::gmock  benchmark::benchmark
#   PkgConfig::LIBMICROHTTPD
#   PkgConfig::LIBMODBUS  PkgConfig::LIBUSB  PkgConfig::ARAVIS   each with its GONIO_WITH_...
#   PkgConfig::UMOCKDEV  with GONIO_WITH_USB: emulates USB devices

set(THREADS_PREFER_PTHREAD_FLAG ON)
find_package(Threads REQUIRED)

find_package(Eigen3 3.4 REQUIRED NO_MODULE)
find_package(OpenBlasPthread REQUIRED)

set(HDF5_PREFER_PARALLEL OFF)
find_package(HDF5 1.10 REQUIRED COMPONENTS C)

find_package(SQLite3 3.34 REQUIRED)
find_package(TIFF REQUIRED)
find_package(PNG REQUIRED)
find_package(tomlplusplus REQUIRED)
find_package(nlohmann_json 3.11 REQUIRED)
find_package(CLI11 2.1 REQUIRED)
find_package(fmt 9 REQUIRED)
find_package(OpenSSL 3 REQUIRED COMPONENTS Crypto)
find_package(OpenCV 4.6 REQUIRED COMPONENTS core imgproc calib3d aruco)

find_package(PkgConfig REQUIRED)
pkg_check_modules(LIBMICROHTTPD REQUIRED IMPORTED_TARGET libmicrohttpd>=0.9.75)
if(GONIO_WITH_MODBUS)
  pkg_check_modules(LIBMODBUS REQUIRED IMPORTED_TARGET libmodbus>=3.1.6)
endif()
if(GONIO_WITH_USB)
  pkg_check_modules(LIBUSB REQUIRED IMPORTED_TARGET libusb-1.0>=1.0.26)
  pkg_check_modules(UMOCKDEV REQUIRED IMPORTED_TARGET umockdev-1.0>=0.17)
endif()
if(GONIO_WITH_ARAVIS)
  pkg_check_modules(ARAVIS REQUIRED IMPORTED_TARGET aravis-0.8>=0.8.26)
endif()

if(GONIO_BUILD_TESTS)
  find_package(GTest 1.12 REQUIRED)
  include(GoogleTest)
endif()
if(GONIO_BUILD_BENCHMARKS)
  find_package(benchmark 1.7 REQUIRED)
endif()
