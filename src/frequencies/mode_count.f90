!> The number of modes of a mesh below a frequency, by Sylvester's law of inertia: the number of negative pivots of K -
!> sigma M.
!>
!> In double precision a factorised K of n = 10^4 elements has no correct digit, because the rounding error of an entry
!> acts like a spring to the ground; its effect grows with n^4. K is therefore assembled and factorised in quadruple
!> precision. The rotational stiffness terms of each element are accurate in double precision; the other terms follow
!> from them by equilibrium in quadruple precision.
module mode_count
   use beam_element, only: element_stiffness
   use beam_model, only: beam_model_t, element_dofs
   use bessel_functions, only: qp
   use kinds, only: wp
   implicit none (type, external)
   private
   public :: modes_below

contains

   !> The number of modes of the beam on its supports, including a rigid-body rotation about the root.
   pure integer function modes_below(model, lambda) result(below)
      type(beam_model_t), intent(in) :: model
      !> Bound on lambda; omega = lambda^2 with E Ibar = rho Abar = L = 1 (Ibar, Abar: section of mean height)
      real(wp), intent(in) :: lambda
      ! whether a rigid support constrains each degree of freedom
      logical :: is_constrained(model%mass%order)

      real(qp), allocatable :: values(:)
      ! stiffness of the springs at the root against displacement and rotation
      real(qp) :: root(2)
      integer :: element, i

      associate (mass => model%mass)
         allocate (values, source=-real(lambda, qp)**4*real(mass%values, qp))
         do element = 1, model%mesh%elements
            call add_stiffness(model, element, values)
         end do
         root = real([model%root%translation_stiffness, model%root%rotation_stiffness], qp)
         do i = 1, 2
            if (model%root_dofs(i) == 0) cycle
            associate (entry => values(mass%diagonal(model%root_dofs(i))))
               entry = entry + root(i)
            end associate
         end do
         do i = 1, size(model%supports)
            associate (entry => values(mass%diagonal(model%supports(i)%dof)))
               entry = entry + real(model%supports(i)%stiffness, qp)
            end associate
         end do
      end associate
      is_constrained = .false.
      is_constrained(pack(model%supports%dof, .not. model%supports%stiffness > 0.0_wp)) = .true.
      call count_negative_pivots(model, is_constrained, values, below)
   end function modes_below

   !> Add the stiffness of an element, whose terms satisfy equilibrium in quadruple precision.
   pure subroutine add_stiffness(model, element, values)
      type(beam_model_t), intent(in) :: model
      integer, intent(in) :: element
      !> Entries of the matrix, stored in the profile of the mass matrix
      real(qp), intent(inout) :: values(:)

      real(qp) :: force(2), length, moment(2, 2), shear, stiffness(4, 4)
      real(wp) :: rounded(4, 4)
      integer :: dofs(4), i, j, index

      associate (mesh => model%mesh)
         rounded = element_stiffness(model%section, mesh%length(element), mesh%tip_distance(element))
         length = real(mesh%length(element), qp)
      end associate
      moment = real(rounded([2, 4], [2, 4]), qp)
      moment(1, 2) = moment(2, 1)
      force = [sum(moment(:, 1)), sum(moment(:, 2))]/length
      shear = sum(force)/length
      stiffness = reshape([ &
         shear, force(1), -shear, force(2), &
         force(1), moment(1, 1), -force(1), moment(1, 2), &
         -shear, -force(1), shear, -force(2), &
         force(2), moment(1, 2), -force(2), moment(2, 2)], [4, 4])
      dofs = element_dofs(model, element)
      do j = 1, 4
         do i = 1, 4
            if (min(dofs(i), dofs(j)) == 0 .or. dofs(i) > dofs(j)) cycle
            index = model%mass%diagonal(dofs(j)) - (dofs(j) - dofs(i))
            values(index) = values(index) + stiffness(i, j)
         end do
      end do
   end subroutine add_stiffness

   !> Number of negative pivots of L D L^T, computed like `factorise` of `skyline_matrix`, without constrained rows and
   !> columns.
   pure subroutine count_negative_pivots(model, is_constrained, values, negative)
      !> Model whose mass matrix has the skyline profile of the matrix
      type(beam_model_t), intent(in) :: model
      logical, intent(in) :: is_constrained(:)
      !> Entries of the matrix; of the factors on return
      real(qp), intent(inout) :: values(:)
      integer, intent(out) :: negative

      ! minimum magnitude of a pivot relative to its entry before elimination
      real(qp), parameter :: min_ratio = epsilon(1.0_qp)**2
      real(qp) :: pivot, min_pivot
      integer :: column, first, k, offset, row, row_offset

      negative = 0
      associate (first_row => model%mass%first_row, diagonal => model%mass%diagonal)
         do column = 1, model%mass%order
            first = first_row(column)
            offset = diagonal(column) - column
            if (is_constrained(column)) then
               values(offset + first:offset + column - 1) = 0.0_qp
               values(offset + column) = 1.0_qp
               cycle
            end if
            do row = first, column - 1
               row_offset = diagonal(row) - row
               do k = max(first, first_row(row)), row - 1
                  values(offset + row) = values(offset + row) - values(row_offset + k)*values(offset + k)
               end do
               if (is_constrained(row)) values(offset + row) = 0.0_qp
            end do
            pivot = values(offset + column)
            ! a zero pivot means a mode of the leading submatrix at this frequency; the count is the same for a small
            ! non-zero pivot
            min_pivot = min_ratio*abs(pivot) + real(tiny(1.0_wp), qp)
            do row = first, column - 1
               pivot = pivot - values(offset + row)**2/values(diagonal(row))
               values(offset + row) = values(offset + row)/values(diagonal(row))
            end do
            if (pivot < 0.0_qp) negative = negative + 1
            values(offset + column) = sign(max(abs(pivot), min_pivot), pivot)
         end do
      end associate
   end subroutine count_negative_pivots

end module mode_count
