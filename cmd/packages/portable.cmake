# SPDX-License-Identifier: Apache-2.0
# cmake -D SETTINGS=FILE -P portable.cmake: packs the program, the manual and the shared libraries
# that they need into an archive, for machines where nothing can be installed, and with the Python
# package into a wheel. Runs on Debian, because the libraries
# come from its packages.
cmake_minimum_required(VERSION 3.22)
include(${SETTINGS})
include(${CMAKE_CURRENT_LIST_DIR}/date.cmake)
include(${CMAKE_CURRENT_LIST_DIR}/libraries.cmake)
include(${CMAKE_CURRENT_LIST_DIR}/licences.cmake)

# Libraries that OpenImageIO needs for cameras, films, DICOM and HEIF, which peeler does not use.
# These are 200 libraries, three quarters of all that OpenImageIO needs, including encoders under the
# GPL.
set(unused "^lib(opencv_|avcodec|avformat|avutil|swscale|dcm|ofstd|oflog|heif)")
# These functions register the DICOM library when it is loaded, so their stand-ins must do nothing.
set(announced "^_ZN10DiRegister[CD][12]Ev$")

# The oldest Linux that Debian's C library supports, by processor.
set(linux_x86_64 3.2)
set(linux_aarch64 3.7)

# make_rpm(ROOT SECONDS): packs the archive's folder, with this date, into an RPM package.
function(make_rpm root seconds)
    set(usr ${folder}/rpm)
    file(MAKE_DIRECTORY ${usr}/bin)
    file(COPY ${root}/share DESTINATION ${usr} PATTERN doc EXCLUDE)
    file(CREATE_LINK ../../opt/peeler/bin/peeler ${usr}/bin/peeler SYMBOLIC)
    execute_process(COMMAND chmod -R u+rwX,go+rX,go-w ${root} ${usr} COMMAND_ERROR_IS_FATAL ANY)
    execute_process(COMMAND find ${root} ${usr} -exec touch -h -d @${seconds} {} +
        COMMAND_ERROR_IS_FATAL ANY)
    execute_process(COMMAND sh -c "umask 022 && SOURCE_DATE_EPOCH=${seconds} exec \"$@\"" sh
        ${cpack} -G RPM --config ${rpm_config} -B ${folder} OUTPUT_QUIET COMMAND_ERROR_IS_FATAL ANY)
    file(REMOVE_RECURSE ${usr} ${folder}/_CPack_Packages)
endfunction()

set(root ${folder}/${name})
file(REMOVE_RECURSE ${root})
foreach(component program manual)
    execute_process(COMMAND ${CMAKE_COMMAND} --install ${build} --component ${component} --strip
        --prefix ${root} OUTPUT_QUIET COMMAND_ERROR_IS_FATAL ANY)
endforeach()
# The launcher takes the place of the programs, and starts them in libexec.
set(programs)
file(MAKE_DIRECTORY ${root}/libexec)
foreach(file bin/peeler ${modules_folder}/peeler_3mf)
    get_filename_component(file_name ${file} NAME)
    list(APPEND programs ${root}/libexec/${file_name})
    file(RENAME ${root}/${file} ${root}/libexec/${file_name})
    execute_process(COMMAND ${strip} -o ${root}/${file} ${launcher} COMMAND_ERROR_IS_FATAL ANY)
endforeach()
# peeler_decode is started without a launcher, so Draco and the C library must be linked into it.
execute_process(COMMAND ${objdump} -p ${root}/${modules_folder}/peeler_decode
    OUTPUT_VARIABLE headers COMMAND_ERROR_IS_FATAL ANY)
if(headers MATCHES "NEEDED +libdraco")
    message(FATAL_ERROR "peeler_decode needs libdraco.so; install Draco's static library")
endif()

set(modules_here)
foreach(module IN LISTS modules)
    list(APPEND modules_here ${root}/${modules_folder}/${module}.so)
endforeach()
copy_libraries(libraries kept ${root}/lib "${machines};${unused}"
    EXECUTABLES ${programs} MODULES ${modules_here})
copy_c_library(${root}/lib/glibc /lib/${architecture})
set(library_folders /usr/lib/${architecture} /lib/${architecture} /usr/lib /lib)
make_stand_ins("${unused}" "${announced}" ${root}/lib ${kept})
collect_licences(${root}/share/doc/peeler ${libraries} ${sources})
file(COPY_FILE ${source}/LICENSE ${root}/share/doc/peeler/LICENSE)
file(COPY_FILE ${CMAKE_CURRENT_LIST_DIR}/portable_readme.txt ${root}/README.txt)

file(READ ${root}/README.txt text)
string(REPLACE "@VERSION@" ${version} text "${text}")
string(REPLACE "@PROCESSOR@" ${processor} text "${text}")
string(REPLACE "@LINUX@" ${linux_${processor}} text "${text}")
file(WRITE ${root}/README.txt "${text}")

set(archive ${folder}/${name}.tar.xz)
read_date(seconds)
# With one thread, all versions of xz write the same bytes. Newer versions use several threads by
# default.
execute_process(COMMAND ${CMAKE_COMMAND} -E env "XZ_OPT=-6 -T1" LC_ALL=C tar -C ${folder} --sort=name
    --format=gnu --owner=0 --group=0 --numeric-owner --mode=u+rwX,go+rX,go-w --mtime=@${seconds}
    -cJf ${archive} ${name} COMMAND_ERROR_IS_FATAL ANY)
if(python_package)
    execute_process(COMMAND ${python} -B ${CMAKE_CURRENT_LIST_DIR}/write_wheel.py ${python_package} ${root}
        ${version} ${processor} ${seconds} ${folder} COMMAND_ERROR_IS_FATAL ANY)
endif()
if(rpmbuild)
    make_rpm(${root} ${seconds})
endif()
file(REMOVE_RECURSE ${root})
file(SIZE ${archive} bytes)
list(LENGTH kept count)
math(EXPR megabytes "(${bytes} + 999999) / 1000000")
message(STATUS "${archive}: ${megabytes} MB with ${count} libraries")
if(bytes GREATER 60000000)
    message(FATAL_ERROR "${archive} has more than 60 MB")
endif()
