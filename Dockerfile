# The static binary and nothing else. Build that first (docs/code.md, "Release"), then:
#
#     install -D target/x86_64-unknown-linux-musl/release/bonepd-ct image/amd64/bonepd-ct
#     docker build -t bonepd-ct .                          # or: buildah bud -t bonepd-ct .
#     docker run --rm --user "$(id -u):$(id -g)" -v "$PWD:/work" bonepd-ct run quick scan.nii.gz -o out
FROM scratch
ARG TARGETARCH=amd64
COPY image/${TARGETARCH}/bonepd-ct /bonepd-ct
WORKDIR /work
ENTRYPOINT ["/bonepd-ct"]
