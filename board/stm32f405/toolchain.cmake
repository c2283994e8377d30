# Cross compilation for the Cortex-M4F with GNU Arm Embedded and newlib-nano (Debian: gcc-arm-none-eabi,
# libnewlib-arm-none-eabi, libstdc++-arm-none-eabi-dev).
set(CMAKE_SYSTEM_NAME Generic)
set(CMAKE_SYSTEM_PROCESSOR cortex-m4)
set(KMAX_CHIP stm32f405)

set(CMAKE_C_COMPILER arm-none-eabi-gcc)
set(CMAKE_CXX_COMPILER arm-none-eabi-g++)
set(CMAKE_ASM_COMPILER arm-none-eabi-gcc)

# CMake's compiler test cannot link: there is no program start without our linker script.
set(CMAKE_TRY_COMPILE_TARGET_TYPE STATIC_LIBRARY)
set(CMAKE_EXECUTABLE_SUFFIX_C .elf)
set(CMAKE_EXECUTABLE_SUFFIX_CXX .elf)
set(CMAKE_EXECUTABLE_SUFFIX_ASM .elf)

set(kmax_cpu_flags "-mcpu=cortex-m4 -mthumb -mfloat-abi=hard -mfpu=fpv4-sp-d16")
# The specs file also selects newlib-nano's headers, so it belongs to compilation as well as to linking.
set(kmax_common_flags "${kmax_cpu_flags} --specs=nano.specs -ffunction-sections -fdata-sections -fno-common")
set(CMAKE_C_FLAGS_INIT "${kmax_common_flags}")
set(CMAKE_ASM_FLAGS_INIT "${kmax_cpu_flags}")
set(CMAKE_CXX_FLAGS_INIT
  "${kmax_common_flags} -fno-exceptions -fno-rtti -fno-threadsafe-statics -fno-use-cxa-atexit")
# The firmware takes templates from the C++ library and links nothing of it, whose archives are a download of 313 MB.
set(CMAKE_CXX_STANDARD_LIBRARIES "-Wl,--start-group -lgcc -lc -lnosys -Wl,--end-group")
set(CMAKE_EXE_LINKER_FLAGS_INIT
  "-nodefaultlibs -nostartfiles -Wl,--gc-sections -Wl,--fatal-warnings -Wl,--no-warn-rwx-segments")

set(CMAKE_FIND_ROOT_PATH_MODE_PROGRAM NEVER)
set(CMAKE_FIND_ROOT_PATH_MODE_LIBRARY ONLY)
set(CMAKE_FIND_ROOT_PATH_MODE_INCLUDE ONLY)
set(CMAKE_FIND_ROOT_PATH_MODE_PACKAGE ONLY)
