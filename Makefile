VENV := .venv
PY := $(VENV)/bin/python

.PHONY: proto
proto:  ## generate Python from proto/
	$(PY) -m grpc_tools.protoc -Iproto --python_out=. --pyi_out=. proto/vistel/v1/*.proto
