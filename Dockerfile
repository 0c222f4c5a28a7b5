# An image with the program and PoCL's CPU device: docs/containers.md. scripts/test-packages runs these steps in a bare Debian.

FROM debian:12 AS packages
COPY . /fathom
RUN /fathom/scripts/package

FROM debian:12-slim
COPY --from=packages /fathom/build/package/fathom_*.deb /fathom/tests/kinect.png /tmp/

# PoCL links what it compiles with the linker of binutils.
RUN apt-get update && apt-get install -y --no-install-recommends /tmp/fathom_*.deb pocl-opencl-icd binutils \
    && rm -rf /var/lib/apt/lists/*

# Kernels are compiled now, for processors such as this one. Whoever runs the image may add to them.
ENV POCL_CACHE_DIR=/var/cache/fathom
RUN mkdir -m 1777 $POCL_CACHE_DIR && cd /tmp && camera=kinect:fx=525,fy=525,cx=319.5,cy=239.5 \
    && fathom linearize kinect.png --preset $camera -o z.exr \
    && fathom normals z.exr --preset $camera,scale=1 -o normals.exr \
    && fathom ssao z.exr --preset $camera,scale=1 --radius 0.5 -o ao.exr \
    && rm -rf /tmp/* && chmod -R a+rwX $POCL_CACHE_DIR

WORKDIR /work
ENTRYPOINT ["fathom"]
CMD ["--help"]
