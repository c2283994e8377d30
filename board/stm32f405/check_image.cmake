# Run after linking: cmake -DELF=... -DNM=... -DREADELF=... -DOBJDUMP=... -DHANDLERS=a,b [-DIN_SRAM=b] -P check_image.cmake
# Fails when the image holds what firmware must not hold, or lies where it must not lie.
cmake_minimum_required(VERSION 3.25)

execute_process(COMMAND ${NM} ${ELF} OUTPUT_VARIABLE symbols COMMAND_ERROR_IS_FATAL ANY)
string(REGEX MATCHALL "[^\n]+" lines "${symbols}")

string(REPLACE "," ";" handlers "${HANDLERS}")
set(problems "")
set(strong "")
foreach(line IN LISTS lines)
  if(NOT line MATCHES "^([0-9a-f]*) +([A-Za-z]) ([^ ]+)$")
    continue()
  endif()
  set(kind ${CMAKE_MATCH_2})
  set(name ${CMAKE_MATCH_3})
  set(address_${name} 0x${CMAKE_MATCH_1})
  # Heap, C++ run-time support for exceptions, statics and abstract classes, process exit and its output.
  if(name MATCHES "^_*(malloc|free|calloc|realloc|reallocf|memalign|aligned_alloc|posix_memalign|strdup|strndup|sbrk)(_r)?$"
     OR name MATCHES "^_Z(n[wa]|d[la])"
     OR name MATCHES "^__cxa_|^__?(gnu_)?[Uu]nwind_|^__gxx_personality|^__aeabi_(unwind|atexit)"
     OR name MATCHES "^_ZSt[0-9]+(__throw_|terminate|set_terminate|unexpected|set_unexpected|uncaught_|rethrow_)"
     OR name MATCHES "^_ZN10__cxxabiv1[0-9]+__(terminate|unexpected)|^_ZN9__gnu_cxx27__verbose_terminate"
     OR name MATCHES "^(abort|exit|_exit|_Exit|quick_exit|atexit|__register_exitproc|raise|__assert_func)$"
     OR name MATCHES "^_*[a-z]*printf(_r)?$|^_?(puts|putchar|fwrite)(_r)?$")
    string(APPEND problems "  ${name}: heap, exception or process support\n")
  endif()
  # Tables of virtual functions and types: calls in the interrupt path are resolved when compiled.
  if(name MATCHES "^_ZT[VTCIS]|^__dynamic_cast$|^_ZN10__cxxabiv1[0-9]+__[a-z_]*type_info")
    string(APPEND problems "  ${name}: virtual function table or type information\n")
  endif()
  # libm. The firmware computes with + - * / and the hardware square root only.
  if(name MATCHES "^(__ieee754_|__kernel_)?(sin|cos|tan|sincos|asin|acos|atan|atan2|sinh|cosh|tanh|exp|exp2|expm1|log|log1p|log2|log10|pow|sqrt|cbrt|hypot|fmod|remainder|rem_pio2|floor|ceil|trunc|round|lround|rint|lrint|nearbyint|modf|frexp|ldexp|scalbn|fma)f?$")
    string(APPEND problems "  ${name}: libm\n")
  endif()
  if(kind STREQUAL "T")
    list(APPEND strong ${name})
  endif()
endforeach()

foreach(handler IN LISTS handlers)
  if(NOT handler IN_LIST strong)
    string(APPEND problems "  ${handler}: the board's handler is not in the vector table (misspelt, or vectors.hpp not included)\n")
  endif()
endforeach()

# What interrupts reach by direct calls and jumps. 64-bit division and arithmetic in double come from the run-time library:
# slow, of data-dependent duration, and allowed outside interrupts only.
execute_process(COMMAND ${OBJDUMP} -d --no-show-raw-insn ${ELF} OUTPUT_VARIABLE code COMMAND_ERROR_IS_FATAL ANY)
# Semicolons and brackets mean something in CMake lists; comments of the disassembler hold both.
string(REGEX MATCHALL "[0-9a-f]+ <[^>\n]+>:|\t(b|bl|b[a-z][a-z])(\\.[nw])?\t[0-9a-f]+ <[^>\n]+>|\tblx?\t(r[0-9]+|ip)|\tbx\t(r[0-9]+|ip)" steps "${code}")
set(function "")
foreach(step IN LISTS steps)
  if(step MATCHES "^[0-9a-f]+ <([^>]+)>:$")
    set(function ${CMAKE_MATCH_1})
    set(disassembled_${function} TRUE)
  elseif(step MATCHES "<([^>+]+)(\\+0x[0-9a-f]+)?>$")
    # The linker puts a step in between where a jump is too far for the instruction.
    string(REGEX REPLACE "^__(.+)_veneer$" "\\1" callee ${CMAKE_MATCH_1})
    if(NOT callee STREQUAL function)
      list(APPEND calls_${function} ${callee})
    endif()
  else()
    set(indirect_${function} TRUE)
  endif()
endforeach()

# What `functions` (ARGN) call, themselves included; from_NAME says by way of what.
function(reach reached)
  set(found ${ARGN})
  set(open ${ARGN})
  while(open)
    list(POP_FRONT open function)
    foreach(callee IN LISTS calls_${function})
      if(NOT callee IN_LIST found)
        list(APPEND found ${callee})
        list(APPEND open ${callee})
        set(from_${callee} ${function} PARENT_SCOPE)
      endif()
    endforeach()
  endwhile()
  set(${reached} ${found} PARENT_SCOPE)
endfunction()

set(reports "")
reach(reached ${handlers})
foreach(function IN LISTS reached)
  if(function MATCHES "^__aeabi_(u?ldivmod|l2f|ul2f|f2lz|f2ulz|l2d|ul2d|d2lz|d2ulz|dadd|dsub|drsub|dmul|ddiv|f2d|d2f|i2d|ui2d|d2iz|d2uiz|dcmp.*|cdcmp.*)$"
     OR function MATCHES "^(__udivmoddi4|__float(un)?didf|__float(un)?disf|__fix(uns)?[sd]fdi|__floatdisf|__floatdidf)$")
    string(APPEND problems "  ${function}: reached from an interrupt by way of ${from_${function}}\n")
  endif()
  if(NOT disassembled_${function})
    string(APPEND problems "  ${function}: reached from an interrupt but not found in the disassembly\n")
  endif()
  if(indirect_${function})
    string(APPEND reports " ${function}")
  endif()
endforeach()

# What has to run without waiting for flash: linker.ld, .tick_code.
string(REPLACE "," ";" in_sram "${IN_SRAM}")
reach(reached ${in_sram})
math(EXPR flash "0x08000000")
foreach(function IN LISTS reached)
  math(EXPR address "${address_${function}}")
  if(address GREATER_EQUAL flash)
    string(APPEND problems "  ${function}: called by what runs from SRAM, but lies in flash (add it to tick_code.ld)\n")
  endif()
  if(indirect_${function})
    string(APPEND problems "  ${function}: runs from SRAM and calls through a pointer, which may lead to flash\n")
  endif()
endforeach()

# linker.ld throws away the tables by which exceptions unwind the stack; this is in case it does not.
execute_process(COMMAND ${READELF} -SW ${ELF} OUTPUT_VARIABLE sections COMMAND_ERROR_IS_FATAL ANY)
string(REGEX MATCHALL " \\.(ARM\\.ex[a-z]+|eh_frame|gcc_except_table)[^ ]* " tables "${sections}")
foreach(table IN LISTS tables)
  string(STRIP ${table} table)
  string(APPEND problems "  ${table}: table for unwinding the stack\n")
endforeach()

execute_process(COMMAND ${READELF} -lW ${ELF} OUTPUT_VARIABLE segments COMMAND_ERROR_IS_FATAL ANY)
string(REGEX MATCHALL "LOAD +0x[0-9a-f]+ 0x[0-9a-f]+ 0x[0-9a-f]+ 0x[0-9a-f]+" loads "${segments}")
if(NOT loads)
  string(APPEND problems "  no loadable segment found\n")
endif()
foreach(load IN LISTS loads)
  string(REGEX MATCH "LOAD +0x[0-9a-f]+ 0x[0-9a-f]+ (0x[0-9a-f]+) (0x[0-9a-f]+)" unused "${load}")
  math(EXPR begin "${CMAKE_MATCH_1}")
  math(EXPR end "${CMAKE_MATCH_1} + ${CMAKE_MATCH_2}")
  math(EXPR parameters_begin "0x08004000")
  math(EXPR parameters_end "0x0800C000")
  math(EXPR file_bytes "${CMAKE_MATCH_2}")
  if(file_bytes GREATER 0 AND begin LESS parameters_end AND end GREATER parameters_begin)
    string(APPEND problems "  a segment at ${CMAKE_MATCH_1}, ${CMAKE_MATCH_2} bytes, covers the parameter sectors 0x08004000-0x0800BFFF\n")
  endif()
endforeach()

if(reports)
  message(STATUS "${ELF}: calls through a pointer in an interrupt, not followed:${reports}")
endif()
if(problems)
  file(REMOVE ${ELF})
  message(FATAL_ERROR "${ELF} is not fit for the target:\n${problems}")
endif()
