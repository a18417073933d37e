!> Dimension scales of a file that is being written: datasets that hold the coordinates along an axis of other datasets
!> (HDF5 Dimension Scale Specification). A dataset holds references to its scales, and a scale holds references to all
!> datasets that use the scale. The list of a scale is written once, at the end: HDF5's own library (H5DS) would rewrite
!> the whole list each time a dataset is attached.
module hdf5_scales
   use, intrinsic :: iso_c_binding, only: c_int, c_int64_t, c_loc, c_null_ptr, c_ptr, c_sizeof
   use hdf5, only: h5aclose_f, h5acreate_f, h5awrite_f, h5dclose_f, h5r_object_f, h5rcreate_f, h5rdereference_f, &
      h5sclose_f, h5screate_simple_f, h5t_compound_f, h5t_native_integer, h5t_std_ref_obj, h5tclose_f, h5tcreate_f, &
      h5tinsert_f, h5tvlen_create_f, hid_t, hsize_t, hvl_t, size_t
   implicit none (type, external)
   private
   public :: scales_t

   !> Use of a scale: reference to the dataset, and the axis of the dataset from 0, in the order of C.
   type, bind(C) :: use_t
      integer(c_int64_t) :: dataset = 0_c_int64_t
      integer(c_int) :: axis = 0_c_int
   end type use_t

   !> A scale, known by the identifier of its group and its name, and its uses. The caller must not close the group
   !> before the last dataset is attached, because a group that is opened a second time has another identifier.
   type :: scale_t
      integer(hid_t) :: group = -1_hid_t
      character(:), allocatable :: name
      !> HDF5's reference to the scale
      integer(c_int64_t) :: reference = 0_c_int64_t
      !> Number of uses
      integer :: count = 0
      type(use_t), allocatable :: uses(:)
   end type scale_t

   !> All scales of one file.
   type :: scales_t
      !> Number of scales
      integer, private :: count = 0
      type(scale_t), allocatable, private :: scale(:)
   contains
      procedure :: attach
      procedure :: write_uses
      procedure, private :: find
   end type scales_t

contains

   !> Attach scales to the first axes of a dataset, in the order of C: names(1) belongs to axis 0, the last index of a
   !> Fortran array. An axis without a name has an empty list of scales.
   subroutine attach(self, dataset, rank, group, names, status)
      class(scales_t), intent(inout) :: self
      integer(hid_t), intent(in) :: dataset
      !> Number of axes of the dataset
      integer, intent(in) :: rank
      !> Group of the scales
      integer(hid_t), intent(in) :: group
      !> Names of the scales; an empty name: none
      character(*), intent(in) :: names(:)
      !> Negative: a call of HDF5 failed. A call that only supplies an argument of a later call is not tested by itself
      integer, intent(out) :: status

      integer(c_int64_t), target :: reference
      ! references to the scales, to which `lists` points until the attribute is written
      integer(c_int64_t), target :: references(size(names))
      type(hvl_t), target :: lists(rank)
      type(c_ptr) :: address
      integer(hid_t) :: attribute, space_id, type_id
      integer :: axis, place

      address = c_loc(reference)
      call h5rcreate_f(dataset, '.', h5r_object_f, address, status)
      if (status < 0) return
      lists = hvl_t(0_size_t, c_null_ptr)
      do axis = 1, size(names)
         if (names(axis) == '') cycle
         call self%find(group, trim(names(axis)), place, status)
         if (status < 0) return
         call add_use(self%scale(place), use_t(reference, int(axis - 1, c_int)))
         references(axis) = self%scale(place)%reference
         lists(axis) = hvl_t(1_size_t, c_loc(references(axis)))
      end do
      call h5tvlen_create_f(h5t_std_ref_obj, type_id, status)
      call h5screate_simple_f(1, [int(rank, hsize_t)], space_id, status)
      call h5acreate_f(dataset, 'DIMENSION_LIST', type_id, space_id, attribute, status)
      if (status < 0) return
      call h5awrite_f(attribute, type_id, c_loc(lists), status)
      if (status < 0) return
      call h5aclose_f(attribute, status)
      call h5sclose_f(space_id, status)
      call h5tclose_f(type_id, status)
   end subroutine attach

   !> Index of a scale; a scale that is used for the first time is added.
   subroutine find(self, group, name, place, status)
      class(scales_t), intent(inout) :: self
      integer(hid_t), intent(in) :: group
      character(*), intent(in) :: name
      integer, intent(out) :: place
      !> Negative: a call of HDF5 failed
      integer, intent(out) :: status

      integer(c_int64_t), target :: reference
      type(c_ptr) :: address
      type(scale_t), allocatable :: more(:)

      status = 0
      do place = self%count, 1, -1
         if (self%scale(place)%group == group .and. self%scale(place)%name == name) return
      end do
      address = c_loc(reference)
      call h5rcreate_f(group, name, h5r_object_f, address, status)
      if (status < 0) return
      if (.not. allocated(self%scale)) allocate (self%scale(16))
      if (self%count == size(self%scale)) then
         allocate (more(2*self%count))
         more(:self%count) = self%scale
         call move_alloc(more, self%scale)
      end if
      self%count = self%count + 1
      place = self%count
      self%scale(place)%group = group
      self%scale(place)%name = name
      self%scale(place)%reference = reference
   end subroutine find

   !> Add a use to a scale.
   pure subroutine add_use(scale, added)
      type(scale_t), intent(inout) :: scale
      type(use_t), intent(in) :: added

      if (.not. allocated(scale%uses)) allocate (scale%uses(16))
      ! twice as many; the second half is overwritten
      if (scale%count == size(scale%uses)) scale%uses = [scale%uses, scale%uses]
      scale%count = scale%count + 1
      scale%uses(scale%count) = added
   end subroutine add_use

   !> Write the uses of all scales, before the file is closed. Afterwards no dataset may be attached, and the object
   !> must not be used for another file.
   subroutine write_uses(self, file, status)
      class(scales_t), target, intent(inout) :: self
      integer(hid_t), intent(in) :: file
      !> Negative: a call of HDF5 failed
      integer, intent(out) :: status

      integer(hid_t) :: attribute, scale, space_id, type_id
      type(use_t) :: one
      integer :: place

      status = 0
      if (self%count == 0) return
      call h5tcreate_f(h5t_compound_f, c_sizeof(one), type_id, status)
      call h5tinsert_f(type_id, 'dataset', 0_size_t, h5t_std_ref_obj, status)
      call h5tinsert_f(type_id, 'dimension', c_sizeof(one%dataset), h5t_native_integer, status)
      if (status < 0) return
      do place = 1, self%count
         associate (used => self%scale(place))
            call h5rdereference_f(file, h5r_object_f, c_loc(used%reference), scale, status)
            if (status < 0) return
            call h5screate_simple_f(1, [int(used%count, hsize_t)], space_id, status)
            call h5acreate_f(scale, 'REFERENCE_LIST', type_id, space_id, attribute, status)
            if (status < 0) return
            call h5awrite_f(attribute, type_id, c_loc(used%uses), status)
            if (status < 0) return
            call h5aclose_f(attribute, status)
            call h5sclose_f(space_id, status)
            call h5dclose_f(scale, status)
         end associate
      end do
      call h5tclose_f(type_id, status)
      self%count = 0
   end subroutine write_uses

end module hdf5_scales
