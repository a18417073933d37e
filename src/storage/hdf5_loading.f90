!> Reading of datasets and attributes from an HDF5 file. The first failure is recorded and later calls do nothing, so
!> the caller tests for failure once.
module hdf5_loading
   use, intrinsic :: iso_c_binding, only: c_associated, c_char, c_f_pointer, c_loc, c_null_char, c_ptr
   use hdf5, only: &
      h5_index_crt_order_f, h5_iter_inc_f, h5aclose_f, h5aget_space_f, h5aget_type_f, h5aopen_by_name_f, &
      h5aread_f, h5dclose_f, h5dget_space_f, h5dget_type_f, h5dopen_f, h5dread_f, h5f_acc_rdonly_f, h5fclose_f, &
      h5fopen_f, h5gclose_f, h5gget_info_f, h5gopen_f, h5i_dataset_f, h5iget_type_f, h5lexists_f, &
      h5lget_name_by_idx_f, h5oclose_f, h5oopen_f, h5p_file_access_f, h5pclose_f, h5pcreate_f, &
      h5pset_fapl_core_f, h5pset_file_image_f, h5sclose_f, h5sget_simple_extent_ndims_f, &
      h5sget_simple_extent_npoints_f, h5t_integer_f, &
      h5t_native_double, h5t_native_integer, h5t_string_f, h5tclose_f, h5tget_class_f, h5tis_variable_str_f, &
      hid_t, hsize_t, size_t
   use hdf5_library, only: c_free, make_text_type, open_hdf5
   use kinds, only: wp
   implicit none (type, external)
   private
   public :: hdf5_source_t, member_t

   !> Maximum length of the name of a member that is read.
   integer, parameter :: max_name_length = 64
   !> A member of a group: a dataset or a subgroup.
   type :: member_t
      !> Name of the member in its group
      character(max_name_length) :: name = ''
      !> Number of its values; -1: the member is a subgroup
      integer(hsize_t) :: points = -1_hsize_t
      !> Number of its dimensions; 0: a single value that is no list
      integer :: rank = 0
      !> Whether the values are integers
      logical :: is_integer = .false.
      !> Whether the values are texts
      logical :: is_text = .false.
   end type member_t

   !> A file open for reading.
   type :: hdf5_source_t
      private
      !> Identifier of the file
      integer(hid_t) :: id = -1_hid_t
      logical :: is_open = .false.
      !> Whether the file was opened and no later call has failed
      logical :: is_good = .false.
   contains
      procedure :: open_bytes
      procedure :: open_file
      procedure :: close_source
      procedure :: is_sound
      !> Load a dataset: name, values. A dataset of another size is a failure.
      generic :: load => load_reals, load_integers, load_texts
      procedure :: text_attribute
      procedure :: number_attribute
      procedure :: has
      procedure :: members_of
      procedure, private :: load_reals, load_integers, load_texts, load_dataset
   end type hdf5_source_t

contains

   !> Open the image of a file in memory.
   subroutine open_bytes(self, bytes)
      class(hdf5_source_t), intent(out) :: self
      !> Bytes of the whole file, which HDF5 copies
      character(*), target, intent(in) :: bytes

      integer(size_t), parameter :: increment = 65536_size_t
      integer(hid_t) :: access
      integer :: status

      call open_hdf5(status)
      call h5pcreate_f(h5p_file_access_f, access, status)
      call h5pset_fapl_core_f(access, increment, .false., status)
      call h5pset_file_image_f(access, c_loc(bytes), len(bytes, kind=size_t), status)
      call h5fopen_f('image', h5f_acc_rdonly_f, self%id, status, access)
      self%is_open = status == 0
      self%is_good = self%is_open
      call h5pclose_f(access, status)
   end subroutine open_bytes

   !> Open a file on the disk.
   subroutine open_file(self, path)
      class(hdf5_source_t), intent(out) :: self
      character(*), intent(in) :: path

      integer :: status

      call open_hdf5(status)
      call h5fopen_f(path, h5f_acc_rdonly_f, self%id, status)
      self%is_open = status >= 0
      self%is_good = self%is_open
   end subroutine open_file

   !> Close the file, if it is open.
   subroutine close_source(self)
      class(hdf5_source_t), intent(inout) :: self

      integer :: status

      if (self%is_open) call h5fclose_f(self%id, status)
      self%is_open = .false.
   end subroutine close_source

   !> Whether no call has failed.
   pure logical function is_sound(self)
      class(hdf5_source_t), intent(in) :: self

      is_sound = self%is_good
   end function is_sound

   subroutine load_reals(self, name, values)
      class(hdf5_source_t), intent(inout) :: self
      character(*), intent(in) :: name
      real(wp), contiguous, target, intent(out) :: values(..)

      if (size(values) > 0) call self%load_dataset(name, h5t_native_double, size(values, kind=hsize_t), c_loc(values))
   end subroutine load_reals

   subroutine load_integers(self, name, values)
      class(hdf5_source_t), intent(inout) :: self
      character(*), intent(in) :: name
      integer, contiguous, target, intent(out) :: values(:)

      if (size(values) > 0) call self%load_dataset(name, h5t_native_integer, size(values, kind=hsize_t), c_loc(values))
   end subroutine load_integers

   !> Load texts; a text longer than an element of `texts` is truncated.
   subroutine load_texts(self, name, texts)
      class(hdf5_source_t), intent(inout) :: self
      character(*), intent(in) :: name
      character(*), intent(out) :: texts(:)

      integer(hid_t) :: type_id
      integer :: status, i
      type(c_ptr), target :: addresses(size(texts))
      character(:), allocatable :: text

      texts = ''
      if (size(texts) == 0) return
      call make_text_type(type_id, status)
      call self%load_dataset(name, type_id, size(texts, kind=hsize_t), c_loc(addresses))
      call h5tclose_f(type_id, status)
      if (.not. self%is_good) return
      do i = 1, size(texts)
         call take_text(addresses(i), text)
         texts(i) = text
      end do
   end subroutine load_texts

   !> Read a dataset of the expected size into memory.
   subroutine load_dataset(self, name, type_id, expected, address)
      class(hdf5_source_t), intent(inout) :: self
      character(*), intent(in) :: name
      !> Type of the values in memory
      integer(hid_t), intent(in) :: type_id
      !> Number of values that the dataset must have
      integer(hsize_t), intent(in) :: expected
      !> Address to which the values are written
      type(c_ptr), intent(in) :: address

      integer(hid_t) :: dataset, space_id
      integer(hsize_t) :: points
      integer :: status
      type(c_ptr) :: location

      if (.not. self%is_good) return
      call h5dopen_f(self%id, name, dataset, status)
      self%is_good = status == 0
      if (.not. self%is_good) return
      call h5dget_space_f(dataset, space_id, status)
      call h5sget_simple_extent_npoints_f(space_id, points, status)
      self%is_good = points == expected
      location = address
      if (self%is_good) call h5dread_f(dataset, type_id, location, status)
      self%is_good = self%is_good .and. status == 0
      call h5sclose_f(space_id, status)
      call h5dclose_f(dataset, status)
   end subroutine load_dataset

   !> Whether the root has a group or dataset of this name.
   logical function has(self, name)
      class(hdf5_source_t), intent(in) :: self
      character(*), intent(in) :: name

      integer :: status

      has = .false.
      if (self%is_good) call h5lexists_f(self%id, name, has, status)
   end function has

   !> List the members of a group in the order in which they were written.
   subroutine members_of(self, group, members)
      class(hdf5_source_t), intent(inout) :: self
      !> Path of the group
      character(*), intent(in) :: group
      type(member_t), allocatable, intent(out) :: members(:)

      integer(hid_t) :: id, object, space_id, type_id
      integer :: count, kind, newest, storage, status, i
      integer(hsize_t) :: k

      allocate (members(0))
      call h5gopen_f(self%id, group, id, status)
      self%is_good = self%is_good .and. status >= 0
      if (.not. self%is_good) return
      call h5gget_info_f(id, storage, count, newest, status)
      deallocate (members)
      allocate (members(count))
      do i = 1, count
         k = int(i - 1, hsize_t)
         call h5lget_name_by_idx_f(id, '.', h5_index_crt_order_f, h5_iter_inc_f, k, members(i)%name, status)
         call h5oopen_f(id, trim(members(i)%name), object, status)
         call h5iget_type_f(object, kind, status)
         if (kind == h5i_dataset_f) then
            call h5dget_space_f(object, space_id, status)
            call h5sget_simple_extent_npoints_f(space_id, members(i)%points, status)
            call h5sget_simple_extent_ndims_f(space_id, members(i)%rank, status)
            call h5sclose_f(space_id, status)
            call h5dget_type_f(object, type_id, status)
            call h5tget_class_f(type_id, kind, status)
            members(i)%is_integer = kind == h5t_integer_f
            members(i)%is_text = kind == h5t_string_f
            call h5tclose_f(type_id, status)
         end if
         call h5oclose_f(object, status)
      end do
      call h5gclose_f(id, status)
   end subroutine members_of

   !> Value of a numeric attribute of an object; 0 if the object does not have the attribute.
   real(wp) function number_attribute(self, name, of) result(value)
      class(hdf5_source_t), intent(in) :: self
      character(*), intent(in) :: name
      !> Path of the object
      character(*), intent(in) :: of

      integer(hid_t) :: attribute
      integer :: status
      real(wp), target :: number
      type(c_ptr) :: location

      value = 0.0_wp
      call h5aopen_by_name_f(self%id, of, name, attribute, status)
      if (status < 0) return
      location = c_loc(number)
      call h5aread_f(attribute, h5t_native_double, location, status)
      if (status >= 0) value = number
      call h5aclose_f(attribute, status)
   end function number_attribute

   !> Text of an attribute of the file or of an object in it; empty if there is no such attribute.
   function text_attribute(self, name, of) result(text)
      class(hdf5_source_t), intent(in) :: self
      character(*), intent(in) :: name
      !> Path of the object; absent: the root
      character(*), intent(in), optional :: of
      character(:), allocatable :: text

      integer(hid_t) :: attribute, space_id, type_id
      integer(hsize_t) :: points
      integer :: status
      logical :: is_text
      type(c_ptr) :: location
      type(c_ptr), target :: address

      text = ''
      if (.not. self%is_good) return
      if (present(of)) then
         call h5aopen_by_name_f(self%id, of, name, attribute, status)
      else
         call h5aopen_by_name_f(self%id, '/', name, attribute, status)
      end if
      if (status < 0) return
      call h5aget_space_f(attribute, space_id, status)
      call h5sget_simple_extent_npoints_f(space_id, points, status)
      call h5sclose_f(space_id, status)
      call h5aget_type_f(attribute, type_id, status)
      call h5tis_variable_str_f(type_id, is_text, status)
      if (is_text .and. points == 1_hsize_t) then
         location = c_loc(address)
         call h5aread_f(attribute, type_id, location, status)
         if (status >= 0) call take_text(address, text)
      end if
      call h5tclose_f(type_id, status)
      call h5aclose_f(attribute, status)
   end function text_attribute

   !> Copy a text that HDF5 has allocated, and free it.
   subroutine take_text(address, text)
      !> Null: the text is empty
      type(c_ptr), intent(in) :: address
      character(:), allocatable, intent(out) :: text

      character(kind=c_char), pointer :: letters(:)

      text = ''
      if (.not. c_associated(address)) return
      ! the length is not known in advance; a null character ends the text
      call c_f_pointer(address, letters, [huge(1)])
      deallocate (text)
      allocate (character(findloc(letters, c_null_char, dim=1) - 1) :: text)
      text(:) = transfer(letters(:len(text)), text)
      call c_free(address)
   end subroutine take_text

end module hdf5_loading
